//! A tree with its bytes.

use std::sync::Arc;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Format, FrameCheck, ReadErrorKind, SurfaceRows, summarise};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{FormatError, StretchError, TriangleRow, VertexTable};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::sentence;
use crate::surface::Surface;
use crate::{bytes, invalid};

/// A view for either index width.
pub enum View<'a> {
    Narrow(dibs_nostd::Tree<'a, u16>),
    Wide(dibs_nostd::Tree<'a, u32>),
}

/// Evaluates `$body` with `$tree` of either index width.
macro_rules! of_any_width {
    ($view:expr, $tree:ident => $body:expr) => {
        match $view {
            $crate::tree::View::Narrow($tree) => $body,
            $crate::tree::View::Wide($tree) => $body,
        }
    };
}
pub(crate) use of_any_width;

self_cell::self_cell!(
    /// The bytes of a tree, and the validated view of them.
    pub struct Validated {
        owner: Vec<u8>,
        #[covariant]
        dependent: View,
    }
);

/// A tree, and the mesh vertices of its rows.
pub struct Owned {
    validated: Validated,
    /// The mesh vertex of each row.
    pub order: Vec<u32>,
    pub origin: DVec3,
}

impl Owned {
    pub fn view(&self) -> &View<'_> {
        self.validated.borrow_dependent()
    }

    /// The tree's bytes.
    pub fn bytes(&self) -> &[u8] {
        self.validated.borrow_owner()
    }

    /// Number of vertices of the tree's mesh.
    pub fn vertices(&self) -> usize {
        of_any_width!(self.view(), tree => tree.file_vertex_count() as usize)
    }

    pub fn label(&self, triangle: TriangleRow) -> Option<u8> {
        of_any_width!(self.view(), tree => tree.label(triangle))
    }
}

/// A tree.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Tree(pub Arc<Owned>);

#[pymethods]
impl Tree {
    #[new]
    fn new(py: Python<'_>, blob: &[u8]) -> PyResult<Self> {
        py.detach(|| Self::from_blob(blob.to_vec()))
    }

    fn blob<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.0.bytes())
    }

    fn origin(&self) -> [f64; 3] {
        self.0.origin.to_array()
    }

    fn vertices(&self) -> usize {
        self.0.vertices()
    }

    /// Size and cost in JSON.
    fn summary(&self) -> PyResult<String> {
        let bytes = self.0.bytes().len();
        let summary = of_any_width!(self.0.view(), tree => summarise(tree, bytes));
        // By way of f64, as `dibs inspect` prints it.
        serde_json::to_value(summary).map(|summary| summary.to_string()).map_err(invalid)
    }

    fn warnings(&self) -> Vec<String> {
        let bytes = self.0.bytes().len();
        let summary = of_any_width!(self.0.view(), tree => summarise(tree, bytes));
        summary.warnings().map(sentence).collect()
    }

    /// The surface with these positions, or at rest; its vertices move at these velocities.
    fn surface(
        &self,
        py: Python<'_>,
        positions: Option<&[u8]>,
        velocities: Option<&[u8]>,
    ) -> PyResult<Surface> {
        py.detach(|| {
            let velocities = velocities.map(|each| self.velocities(each)).transpose()?;
            let rows = match positions {
                Some(positions) => {
                    let origin = self.0.origin;
                    let at = |position: DVec3| (position - origin).as_vec3();
                    let positions: Vec<Vec3> = bytes::points(positions).into_iter().map(at).collect();
                    let check = of_any_width!(self.0.view(), tree => FrameCheck::of(tree));
                    check.to_rows(&positions).map_err(|error| invalid(format!("surface: {error}")))?
                }
                None => of_any_width!(self.0.view(), tree => SurfaceRows::rest_frame(tree))
                    .ok_or_else(|| invalid("the tree has no rest shape; give positions"))?,
            };
            let rows = of_any_width!(self.0.view(), tree => SurfaceRows::of(tree, rows));
            let rows = rows.map_err(invalid)?;
            let stretch = match rows.stretch {
                Ok(measured) => Some(measured),
                Err(StretchError::NoMetric) => None,
                // Beyond the stretch limit a distance could be wrong, so the surface is refused.
                Err(error) => {
                    let remedy = "build the tree with a larger stretch, or with limits that allow it";
                    let refused = of_any_width!(self.0.view(), tree => SurfaceRows::refusal(tree, error, remedy));
                    return Err(invalid(refused));
                }
            };
            Ok(Surface { tree: Arc::clone(&self.0), rows, velocities, stretch })
        })
    }
}

impl Tree {
    /// Velocities of the mesh's vertices in the order of the rows.
    fn velocities(&self, of_mesh: &[u8]) -> PyResult<Vec<Vec3>> {
        let of_mesh = bytes::points(of_mesh);
        if let Ok(nodes) = of_any_width!(self.0.view(), tree => Nodes::of(tree)) {
            // The velocity of a vertex is a weighted mean of its nodes' velocities, as its position is.
            let of_nodes: Vec<Vec3> = of_mesh.iter().map(|velocity| velocity.as_vec3()).collect();
            let surface = nodes.surface(of_nodes.as_slice());
            return match surface.len() {
                0 => {
                    let (needed, found) = (nodes.count(), of_nodes.len());
                    Err(invalid(format!("{found} velocities and the tree has {needed} nodes")))
                }
                rows => Ok((0..rows as u32).filter_map(|row| surface.position(row)).collect()),
            };
        }
        let row = |&vertex: &u32| of_mesh.get(vertex as usize).map(|velocity| velocity.as_vec3());
        self.0.order.iter().map(row).collect::<Option<_>>().ok_or_else(|| {
            let (needed, found) = (self.0.vertices(), of_mesh.len());
            invalid(format!("{found} velocities and the tree uses {needed} vertices"))
        })
    }

    /// Validates the bytes of a tree.
    pub fn from_blob(blob: Vec<u8>) -> PyResult<Self> {
        let validated = Validated::try_new_or_recover(blob, |bytes| view(bytes))
            .map_err(|(blob, error)| invalid(what_it_is(&blob, &error)))?;
        let (order, origin) = of_any_width!(validated.borrow_dependent(), tree => {
            let number = |row| tree.vertex_number(row).map_or(row, |number| number.0);
            ((0..tree.vertex_count()).map(number).collect(), tree.origin().into())
        });
        Ok(Self(Arc::new(Owned { validated, order, origin })))
    }
}

/// What bytes are that are not a tree.
fn what_it_is(bytes: &[u8], error: &FormatError) -> String {
    match Format::of(bytes, "") {
        Ok(format) if !bytes.starts_with(b"DIBS") => {
            format!(
                "not a tree: this is a mesh ({format}); give it to read_mesh and build its tree"
            )
        }
        Err(ReadErrorKind::Foreign { what, .. }) => format!("not a tree: this is {what}"),
        _ => format!("not a valid tree: {error}; build it again"),
    }
}

fn view(bytes: &[u8]) -> Result<View<'_>, FormatError> {
    match dibs_nostd::Tree::<u16>::from_bytes(bytes) {
        Err(FormatError::Width { .. }) => {
            dibs_nostd::Tree::<u32>::from_bytes(bytes).map(View::Wide)
        }
        narrow => narrow.map(View::Narrow),
    }
}

//! Frames: the surface at one moment.

use core::ffi::c_void;

use dibs_nostd::glam::Vec3;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{MeasuredStretch, VertexTable, measure_stretch};

use crate::border::{Handle, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::surface::HeldFrame;
use crate::tree::dibs_tree;

/// Bytes of a frame's storage.
pub const DIBS_FRAME_SIZE: usize = 192;

/// The surface at one moment: the caller's vertices, or the frame that a reader holds. Queries search it.
///
/// One context at a time.
pub struct dibs_frame {
    pub(crate) table: Table,
}

impl Kind for dibs_frame {
    const MARK: u32 = 0x6462_6606;
    const SIZE: usize = DIBS_FRAME_SIZE;
}

/// The positions of a frame.
pub(crate) enum Table {
    Empty,
    Vertices(Vertices),
    Held(HeldFrame),
}

/// For calls that take several frames, each of either kind.
impl VertexTable for Table {
    fn len(&self) -> usize {
        match self {
            Self::Empty => 0,
            Self::Vertices(vertices) => vertices.len(),
            Self::Held(held) => held.len(),
        }
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        match self {
            Self::Empty => None,
            Self::Vertices(vertices) => vertices.position(vertex),
            Self::Held(held) => held.position(vertex),
        }
    }

    fn epoch(&self) -> Option<u32> {
        match self {
            Self::Empty | Self::Vertices(_) => None,
            Self::Held(held) => held.epoch(),
        }
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        match self {
            Self::Empty => None,
            Self::Vertices(vertices) => vertices.stretch(),
            Self::Held(held) => held.stretch(),
        }
    }

    fn position_error(&self) -> f32 {
        match self {
            Self::Empty => 0.0,
            Self::Vertices(vertices) => vertices.position_error(),
            Self::Held(held) => held.position_error(),
        }
    }
}

/// The caller's vertices, or those that the caller's nodes move.
pub(crate) struct Vertices {
    rows: Rows,
    nodes: Option<&'static Nodes<'static>>,
    stretch: Option<MeasuredStretch>,
}

/// The caller's positions.
struct Rows {
    rows: &'static [[f32; 3]],
    position_error: f32,
}

impl Vertices {
    /// Vertices whose stretch is not measured.
    pub(crate) const fn new(rows: &'static [[f32; 3]], position_error: f32) -> Self {
        Self { rows: Rows { rows, position_error }, nodes: None, stretch: None }
    }
}

impl VertexTable for Rows {
    fn len(&self) -> usize {
        self.rows.len()
    }

    #[inline(always)]
    fn position(&self, row: u32) -> Option<Vec3> {
        self.rows.get(row as usize).copied().map(Vec3::from_array)
    }

    fn position_error(&self) -> f32 {
        self.position_error
    }
}

impl VertexTable for Vertices {
    fn len(&self) -> usize {
        self.nodes.map_or(self.rows.len(), |nodes| nodes.surface(&self.rows).len())
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        match self.nodes {
            None => self.rows.position(vertex),
            Some(nodes) => nodes.surface(&self.rows).position(vertex),
        }
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.stretch
    }

    fn position_error(&self) -> f32 {
        let own = self.rows.position_error();
        self.nodes.map_or(own, |nodes| nodes.surface(&self.rows).position_error())
    }
}

/// Calls a function of the core with the frame's table and the tool, each as its own type.
macro_rules! ask {
    ($frame:expr, $shape:expr, |$table:ident, $tool:ident| $call:expr) => {{
        use crate::frame::Table;
        use crate::tool::Shape;
        match (&$frame.table, &$shape) {
            (Table::Empty, _) => Err(crate::code::dibs_code::NoSurface),
            (Table::Vertices($table), Shape::Sphere($tool)) => $call.map_err(Into::into),
            (Table::Vertices($table), Shape::Capsule($tool)) => $call.map_err(Into::into),
            (Table::Held($table), Shape::Sphere($tool)) => $call.map_err(Into::into),
            (Table::Held($table), Shape::Capsule($tool)) => $call.map_err(Into::into),
        }
    }};
}
pub(crate) use ask;

/// Makes an empty frame. If the storage has a frame that a reader holds, it is released first.
///
/// @param storage  `DIBS_FRAME_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param frame    Receives the frame's address.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_init(
    storage: *mut c_void,
    size: usize,
    frame: *mut *mut dibs_frame,
) -> dibs_code {
    dibs_code::of(|| storage.make(size, frame, || Ok(dibs_frame { table: Table::Empty })))
}

/// Sets the frame to these vertices. Their stretch is not measured: queries assume the tree's limit.
///
/// @param frame           The frame; if a reader holds it, it is released first.
/// @param positions       x, y and z (mm) of each vertex, in the tree's order of rows, not that of the mesh's file:
///                        `dibs_tree_to_rows`. Not copied: they must not change until the frame is given other vertices
///                        or released.
/// @param vertices        Their number.
/// @param position_error  Largest error (mm, at least 0) of a vertex position. Part of the accuracy of every answer.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for an error that is negative or not finite, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_set_vertices(
    frame: *mut dibs_frame,
    positions: *const f32,
    vertices: u32,
    position_error: f32,
) -> dibs_code {
    dibs_code::of(|| {
        let mut frame = frame.open()?;
        let rows = rows(positions, vertices)?;
        if !(position_error >= 0.0 && position_error.is_finite()) {
            return Err(dibs_code::Argument);
        }
        frame.table = Table::Vertices(Vertices::new(rows, position_error));
        Ok(())
    })
}

/// Sets the frame to the surface that these nodes move, for a tree that `dibs build --nodes` made. Vertices are
/// computed when a query reads them. The stretch is not measured: queries assume the tree's limit.
///
/// @param frame           The frame; if a reader holds it, it is released first.
/// @param tree            The tree, which must exist as long as the frame has these nodes.
/// @param positions       x, y and z (mm) of each node, in the order of the volume's file. Not copied: they must not
///                        change until the frame is given other positions or released.
/// @param nodes           Their number.
/// @param position_error  Largest error (mm, at least 0) of a node position.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_VERTEX_COUNT` for another number than the tree's `rows`, `DIBS_CODE_ARGUMENT` if
///         the tree has no nodes, or for an error that is negative or not finite, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_set_nodes(
    frame: *mut dibs_frame,
    tree: *mut dibs_tree,
    positions: *const f32,
    nodes: u32,
    position_error: f32,
) -> dibs_code {
    dibs_code::of(|| {
        let (mut frame, tree) = (frame.open()?, tree.share()?);
        let rows = rows(positions, nodes)?;
        let own = tree.nodes.as_ref().ok_or(dibs_code::Argument)?;
        if !(position_error >= 0.0 && position_error.is_finite()) {
            return Err(dibs_code::Argument);
        }
        if own.count() != nodes {
            return Err(dibs_code::VertexCount);
        }
        let vertices = Vertices::new(rows, position_error);
        frame.table = Table::Vertices(Vertices { nodes: Some(own), ..vertices });
        Ok(())
    })
}

/// The caller's positions.
pub(crate) fn rows(positions: *const f32, count: u32) -> Result<&'static [[f32; 3]], dibs_code> {
    let floats = (count as usize).checked_mul(3).ok_or(dibs_code::Argument)?;
    let (rows, _) = positions.slice(floats)?.as_chunks();
    Ok(rows)
}

/// Measures the stretch of the frame, which makes queries on it cheaper. A receiver's frames are already measured.
///
/// Cost: linear in the triangles.
///
/// @param stretch  Receives the largest stretch, 1 for none; or null.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_STRETCH_EXCEEDED` if distances on this frame could be wrong, as with vertices in
///         the file's order, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_TREE_NO_METRIC`,
///         `DIBS_CODE_VERTEX_COUNT`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_measure(
    frame: *mut dibs_frame,
    tree: *mut dibs_tree,
    stretch: *mut f32,
) -> dibs_code {
    dibs_code::of(|| {
        let (stretch, mut frame) = (stretch.check_if_any()?, frame.open()?);
        let tree = &tree.share()?.tree;
        let measured = match &mut frame.table {
            Table::Empty => return Err(dibs_code::NoSurface),
            Table::Held(held) => held.stretch().ok_or(dibs_code::NoSurface)?,
            Table::Vertices(vertices) => {
                vertices.stretch = None;
                let measured = match vertices.nodes {
                    Some(nodes) => nodes.measure(&vertices.rows)?,
                    None => measure_stretch(tree, vertices)?,
                };
                vertices.stretch = Some(measured);
                measured
            }
        };
        Out::set_if_any(stretch, measured.sigma());
        Ok(())
    })
}

/// Properties of a frame.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_frame_facts {
    /// Number of vertices.
    pub vertices: u32,
    /// Largest error (mm) of a vertex position. Part of the accuracy of every answer.
    pub position_error: f32,
    /// The largest stretch, 1 for none; 0 if it was not measured.
    pub stretch: f32,
}

impl dibs_frame_facts {
    fn of(table: &impl VertexTable) -> Self {
        Self {
            vertices: table.len() as u32,
            position_error: table.position_error(),
            stretch: table.stretch().map_or(0.0, |measured| measured.sigma()),
        }
    }
}

/// Reads the properties of a frame.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_get_facts(
    frame: *mut dibs_frame,
    facts: *mut dibs_frame_facts,
) -> dibs_code {
    dibs_code::of(|| {
        let (facts, frame) = (facts.check()?, frame.open()?);
        facts.set(match &frame.table {
            Table::Empty => return Err(dibs_code::NoSurface),
            Table::Vertices(vertices) => dibs_frame_facts::of(vertices),
            Table::Held(held) => dibs_frame_facts::of(held),
        });
        Ok(())
    })
}

/// Releases the vertices, or the frame that a reader holds: the next frame can then be published.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_frame_release(frame: *mut dibs_frame) -> dibs_code {
    dibs_code::of(|| {
        frame.open()?.table = Table::Empty;
        Ok(())
    })
}

//! The built tree, and its two outputs: a blob, and a Rust module around it.

use std::collections::HashSet;
use std::path::Path;

use dibs_nostd::format::{PathKind, Unit};
use dibs_nostd::glam::{DVec3, Vec3};
use dibs_nostd::modes::Modes;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{FormatError, Index, Tree, TriangleRow, VertexTable};

use crate::error::BuildError;
use crate::write_atomically;

/// A tree as bytes, with the data that a host needs.
#[derive(Clone, Debug)]
pub struct BuiltTree {
    pub(super) bytes: Vec<u8>,
    pub(super) order: Vec<u32>,
    pub(super) index_bytes: usize,
    pub(super) origin: DVec3,
    #[cfg(feature = "modes")]
    pub(super) motion: Option<crate::modes::ModalMotion>,
}

/// The size and cost of a tree.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Summary {
    /// Triangles.
    pub triangles: u32,
    /// Vertices.
    pub vertices: u32,
    /// Nodes: inner ones, leaves and the roots.
    pub nodes: u32,
    /// Stack entries that a query needs.
    pub stack: u32,
    /// Bits of an index.
    pub index_bits: u32,
    /// The stretch limit; where triangles have their own, the largest.
    pub stretch: f32,
    /// The least stretch limit of any triangle, or tetrahedron.
    pub least_stretch_limit: f32,
    /// Triangles that the controller's stretch check refuses even at rest, because they are too small for its
    /// arithmetic. If there is any, no frame is ever published.
    pub unmeasurable: u32,
    /// The vertices of the first of them, by the mesh's numbers.
    pub first_unmeasurable: Option<[u32; 3]>,
    /// Whether radii were measured across triangles. If not: along edges, or through a [volume](Self::volume).
    pub surface_paths: bool,
    /// Roots: one for each part of the surface that shares no vertex with another.
    pub roots: u32,
    /// Radius of the largest root's sphere at rest, in mm.
    pub root_radius: f32,
    /// The corners of the box around the vertices at rest; `None` if the tree has neither a rest shape nor nodes.
    pub bounding_box: Option<[[f32; 3]; 2]>,
    /// Mean length of the triangles' sides at rest.
    pub mean_edge: Option<f64>,
    /// Different labels of the triangles; 0 if they have none.
    pub labels: usize,
    /// The point of the mesh's file (mm) that the tree's coordinates count from.
    pub origin: [f64; 3],
    /// The unit of the mesh's file, if the builder was told: `mm`, `cm`, `m`, `in` or `um`. The tree is in millimetres.
    pub unit: Option<&'static str>,
    /// Vertices of the mesh's file, including those of no triangle: positions of a frame.
    pub file_vertices: u32,
    /// Triangles of the mesh's file, including those that were dropped.
    pub file_triangles: u32,
    /// Identity of the mesh, as vertex packets carry it.
    pub mesh_id: u32,
    /// Flash that a query reads: nodes and triangles.
    pub query_bytes: usize,
    /// The same, for each triangle of the surface.
    pub query_bytes_per_triangle: f64,
    /// Flash of the adjacency, from which sides are found; 0 if the surface has none.
    pub adjacency_bytes: usize,
    /// Flash of the whole tree with all its optional sections.
    pub flash_bytes: usize,
    /// RAM of the surface: `dibs_nostd::Frames`, two buffers of f32 positions, and their labels.
    pub ram_bytes: usize,
    /// RAM of one query's stack.
    pub stack_bytes: usize,
    /// Its displacement modes, if any.
    pub modes: Option<ModesSummary>,
    /// The volume that carries it, if any.
    pub volume: Option<VolumeSummary>,
}

/// The size and cost of the volume that carries a tree's surface.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct VolumeSummary {
    /// Nodes: rows of a frame.
    pub nodes: u32,
    /// Tetrahedra.
    pub tetrahedra: u32,
    /// The largest displacement of a vertex for a displacement of one millimetre of the nodes: 1 if no vertex is
    /// outside of the volume.
    pub amplification: f32,
    /// Flash of nodes, tetrahedra and weights, part of the tree's.
    pub flash_bytes: usize,
    /// RAM of the nodes: `dibs_nostd::Frames`, two buffers of f32 positions, and their labels.
    pub ram_bytes: usize,
}

/// The size and cost of a tree's modes. Lengths are in mm.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ModesSummary {
    /// Number of modes: weights of a frame.
    pub count: usize,
    /// Largest distance of any vertex from the motion that they were fitted to, in any frame.
    pub position_error: f32,
    /// Root mean square of that distance.
    pub rms_error: f32,
    /// Fraction of the recorded range by which a weight may exceed it, at either end.
    pub margin: f32,
    /// Recorded shapes that the stretch bound starts from.
    pub anchors: usize,
    /// Flash of the modes, part of the tree's.
    pub flash_bytes: usize,
    /// The same, for each vertex.
    pub flash_bytes_per_vertex: f64,
}

/// Least extent (mm) of a plausible surface: an organ in metres that is read as millimetres is smaller.
const LEAST_SIZE: f32 = 1.0;

/// Largest plausible extent (mm): an organ in micrometres that is read as millimetres is larger.
const LARGEST_SIZE: f32 = 10_000.0;

impl Summary {
    /// Warnings for a user, one sentence each.
    pub fn warnings(&self) -> impl Iterator<Item = String> + use<> {
        let unmeasurable = self.unmeasurable;
        let sentence = self.first_unmeasurable.map(|[a, b, c]| {
            format!(
                "{unmeasurable} triangles (the first has the vertices {a}, {b} and {c}) are too small for the \
                 controller's stretch check, which would refuse every frame: weld or drop them"
            )
        });
        sentence.into_iter().chain(self.implausible())
    }

    /// The warning for a size that no organ has, which means that the lengths are in another unit.
    fn implausible(&self) -> Option<String> {
        let [low, high] = self.bounding_box?;
        let size = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max);
        let (what, unit) = match size {
            size if size < LEAST_SIZE => ("small", Unit::Metre),
            size if size > LARGEST_SIZE => ("large", Unit::Micrometre),
            _ => return None,
        };
        let read = self.unit.unwrap_or(Unit::Millimetre.symbol());
        Some(format!(
            "the surface is {size:.3} mm across, too {what} for an organ, with lengths taken to be in {read}: give their \
             unit, as in --unit {unit}, or scale the mesh"
        ))
    }
}

impl BuiltTree {
    pub(crate) fn new<I: Index>(bytes: Vec<u8>, order: Vec<u32>, origin: DVec3) -> Self {
        Self {
            bytes,
            order,
            index_bytes: I::BYTES,
            origin,
            #[cfg(feature = "modes")]
            motion: None,
        }
    }

    /// The tree's bytes, as a `.dibs` file holds them (`dibs-nostd`'s `docs/format.md`).
    #[must_use]
    pub fn blob(&self) -> &[u8] {
        &self.bytes
    }

    /// The mesh vertex of each row of the tree's vertex table.
    #[must_use]
    pub fn vertex_order(&self) -> &[u32] {
        &self.order
    }

    /// Bits of an index: 16 or 32.
    #[must_use]
    pub fn index_bits(&self) -> u32 {
        8 * self.index_bytes as u32
    }

    /// The tree, if its indices are of type `I`.
    ///
    /// # Errors
    /// [`FormatError::Width`] otherwise.
    pub fn tree<I: Index>(&self) -> Result<Tree<'_, I>, FormatError> {
        Tree::from_bytes(&self.bytes)
    }

    /// Reorders one value per mesh vertex into the order of the tree's rows.
    ///
    /// # Panics
    /// If `of_mesh` does not have a value for each of the mesh's vertices.
    #[must_use]
    pub fn to_rows<T: Copy>(&self, of_mesh: &[T]) -> Vec<T> {
        self.order.iter().map(|&vertex| of_mesh[vertex as usize]).collect()
    }

    /// The point of the mesh's file (mm) that the tree's coordinates count from: [`Mesh::origin`](crate::Mesh::origin).
    #[must_use]
    pub const fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Converts positions in the file's coordinates (mm), one a mesh vertex, to rows of the tree's vertex table:
    /// relative to the [origin](Self::origin), then rounded to f32, in the order of the rows.
    ///
    /// # Panics
    /// If `of_mesh` does not have a position for each of the mesh's vertices.
    #[must_use]
    pub fn local_rows(&self, of_mesh: &[DVec3]) -> Vec<Vec3> {
        let row = |&vertex: &u32| (of_mesh[vertex as usize] - self.origin).as_vec3();
        self.order.iter().map(row).collect()
    }

    /// The tree's size and cost.
    #[must_use]
    pub fn summary(&self) -> Summary {
        // The builder validated these bytes.
        let summary = match self.index_bytes {
            2 => self.tree::<u16>().map(|tree| summarise(&tree, self.bytes.len())),
            _ => self.tree::<u32>().map(|tree| summarise(&tree, self.bytes.len())),
        };
        summary.unwrap_or_else(|error| unreachable!("a built tree is valid: {error}"))
    }

    /// Writes the blob.
    ///
    /// # Errors
    /// [`BuildError::Write`]; a file of that name is then as it was.
    pub fn write_blob(&self, path: impl AsRef<Path>) -> Result<(), BuildError> {
        write(path.as_ref(), &self.bytes)
    }

    /// Writes a Rust module of the given name, for `include!` or
    /// [`include_tree!`](dibs_nostd::include_tree), and beside it the blob that the module includes: of
    /// `heart.rs`, `heart.dibs`.
    ///
    /// The builder validated the blob, and the program validates it again when it starts. The compiler only copies it,
    /// so a large tree compiles as fast as a small one.
    ///
    /// # Errors
    /// [`BuildError::Name`] if `name` cannot name a module, or [`BuildError::Write`]. A file that cannot be
    /// written is left as it was.
    pub fn write_rust(&self, path: impl AsRef<Path>, name: &str) -> Result<(), BuildError> {
        let (path, blob) = (path.as_ref(), path.as_ref().with_extension("dibs"));
        let file = blob.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let source = super::module::source(self, name, &file)?;
        self.write_blob(blob)?;
        write(path, source.as_bytes())
    }
}

fn write(path: &Path, content: &[u8]) -> Result<(), BuildError> {
    Ok(write_atomically(path, |file| file.write_all(content))?)
}

/// The size and cost of any validated tree of `length` bytes.
#[must_use]
pub fn summarise<I: Index>(tree: &Tree<'_, I>, length: usize) -> Summary {
    let vertices = tree.vertex_count();
    let unmeasurable = || (0..tree.triangle_count()).filter(|&row| !is_measurable(tree, row));
    let number = |vertex| tree.vertex_number(vertex).map_or(Some(vertex), |number| Some(number.0));
    let roots = tree.roots();
    let volume = Nodes::of(tree).ok();
    let in_mesh = |row| row_of(tree.corners(TriangleRow(row))?, number);
    Summary {
        triangles: tree.triangle_count(),
        vertices,
        nodes: tree.node_count(),
        stack: tree.stack(),
        index_bits: 8 * I::BYTES as u32,
        stretch: tree.stretch(),
        least_stretch_limit: match &volume {
            Some(nodes) => crate::nodes::least_stretch_limit(nodes),
            None => (0..tree.triangle_count())
                .filter_map(|row| tree.stretch_limit(TriangleRow(row)))
                .fold(tree.stretch(), f32::min),
        },
        unmeasurable: unmeasurable().count() as u32,
        first_unmeasurable: unmeasurable().next().and_then(in_mesh),
        surface_paths: tree.paths() == PathKind::Surface,
        roots,
        root_radius: (0..roots)
            .filter_map(|row| tree.node(row).map(|(_, radius, _)| radius))
            .fold(0.0, f32::max),
        bounding_box: bounding_box(tree),
        mean_edge: mean_edge(tree),
        labels: labels(tree),
        origin: tree.origin(),
        unit: tree.unit().map(Unit::symbol),
        file_vertices: tree.file_vertex_count(),
        file_triangles: tree.file_triangle_count(),
        mesh_id: tree.mesh_id(),
        query_bytes: tree.query_bytes(),
        query_bytes_per_triangle: tree.query_bytes() as f64 / f64::from(tree.triangle_count()),
        adjacency_bytes: tree.adjacency_bytes(),
        flash_bytes: length,
        ram_bytes: ram_of(vertices),
        stack_bytes: 8 * tree.stack() as usize,
        modes: Modes::of(tree).ok().map(|modes| ModesSummary {
            count: modes.count(),
            position_error: modes.position_error(),
            rms_error: modes.rms_error(),
            margin: modes.margin(),
            anchors: modes.anchor_count(),
            flash_bytes: modes.flash_bytes(),
            flash_bytes_per_vertex: modes.flash_bytes() as f64 / f64::from(vertices),
        }),
        volume: volume.map(|nodes| VolumeSummary {
            nodes: nodes.count(),
            tetrahedra: nodes.element_count(),
            amplification: nodes.amplification(),
            flash_bytes: nodes.flash_bytes(),
            ram_bytes: ram_of(nodes.count()),
        }),
    }
}

/// RAM of two buffers of so many rows.
fn ram_of(rows: u32) -> usize {
    (24 * rows as usize + 117).next_multiple_of(4)
}

fn labels<I: Index>(tree: &Tree<'_, I>) -> usize {
    let labels = (0..tree.triangle_count()).filter_map(|row| tree.label(TriangleRow(row)));
    labels.collect::<HashSet<u8>>().len()
}

fn bounding_box<I: Index>(tree: &Tree<'_, I>) -> Option<[[f32; 3]; 2]> {
    let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let nodes = Nodes::of(tree).ok();
    let at_rest = |nodes: Nodes<'_>| {
        (0..nodes.count()).filter_map(|node| nodes.rest_position(node)).collect()
    };
    let at_rest: Vec<Vec3> = nodes.map_or_else(Vec::new, at_rest);
    for row in 0..tree.vertex_count() {
        let embedded = || nodes?.surface(at_rest.as_slice()).position(row);
        let position = tree.rest_position(row).or_else(embedded)?;
        bounds = [bounds[0].min(position), bounds[1].max(position)];
    }
    Some(bounds.map(|bound| bound.to_array()))
}

fn mean_edge<I: Index>(tree: &Tree<'_, I>) -> Option<f64> {
    let mut sum = 0.0;
    for row in 0..tree.triangle_count() {
        let corners = tree.corners(TriangleRow(row))?;
        let [a, b, c] = row_of(corners, |v| tree.rest_position(v))?.map(Vec3::as_dvec3);
        sum += a.distance(b) + b.distance(c) + c.distance(a);
    }
    Some(sum / (3.0 * f64::from(tree.triangle_count())))
}

/// Whether the stretch check can pass a triangle at rest; true for a tree without a metric.
fn is_measurable<I: Index>(tree: &Tree<'_, I>, row: u32) -> bool {
    let Some(metric) = tree.metric(row) else { return true };
    let corners = tree.corners(TriangleRow(row)).and_then(|c| row_of(c, |v| tree.rest_position(v)));
    let [first, between, second] = metric.squares;
    let Some(corners) = corners else { return first > 0.0 };
    let [a, b, c] = metric.centre_first(corners);
    let (e1, e2) = ((b - a).as_dvec3(), (c - a).as_dvec3());
    // The builder has lowered the metric by the check's largest rounding.
    let limit = f64::from(tree.stretch()).powi(2);
    let left = |rest: f32, now: f64| limit * f64::from(rest) - now;
    let (x, z) = (left(first, e1.length_squared()), left(second, e2.length_squared()));
    match tree.paths() {
        PathKind::EdgePath => {
            first > 0.0 && x >= 0.0 && z >= 0.0 && left(between, (e2 - e1).length_squared()) >= 0.0
        }
        _ => first > 0.0 && x > 0.0 && x * z >= left(between, e1.dot(e2)).powi(2),
    }
}

/// A value for each corner; `None` if any corner has none.
fn row_of<T>(corners: [u32; 3], of: impl Fn(u32) -> Option<T>) -> Option<[T; 3]> {
    let [a, b, c] = corners.map(of);
    Some([a?, b?, c?])
}

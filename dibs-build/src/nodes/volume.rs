//! A volume of tetrahedra that has passed its checks.

use dibs_nostd::nodes::{MAX_ELEMENTS, MAX_NODES};
use glam::{DMat3, DVec3, UVec3};

use crate::Mesh;

/// A coarse model: nodes, and tetrahedra that move a surface. A frame lists the nodes in this order.
///
/// ```
/// use dibs_build::{Volume, generate};
/// let heart = generate::heart(320)?.mesh;
/// let lattice = Volume::lattice(&heart, [3, 3, 3])?;
/// assert_eq!((lattice.nodes().len(), lattice.tetrahedra().len()), (64, 162));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    nodes: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    /// Whether the tetrahedra fill a box, so that every straight line in it is a path through them.
    is_box: bool,
    /// The largest distance (mm) of vertices outside that are bound.
    within: f64,
}

/// Why a volume cannot move a surface.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// Too many or no tetrahedra or nodes.
    #[error(
        "the volume has {nodes} nodes and {tetrahedra} tetrahedra: a tree holds 4 to {MAX_NODES} and 1 to {MAX_ELEMENTS}; \
         mesh it coarser"
    )]
    Size {
        /// Nodes.
        nodes: usize,
        /// Tetrahedra.
        tetrahedra: usize,
    },
    /// A tetrahedron names a node that does not exist.
    #[error(
        "tetrahedron {tetrahedron} (counted from 0) refers to node {node}, but the volume has {nodes} nodes numbered from \
         0: export it again"
    )]
    Corner {
        /// The tetrahedron.
        tetrahedron: usize,
        /// The node it names.
        node: u32,
        /// Nodes of the volume.
        nodes: usize,
    },
    /// A node has a coordinate that is not finite.
    #[error(
        "node {node} (counted from 0) has a coordinate that is not a finite number: repair the volume, or export it again"
    )]
    Coordinate {
        /// The node.
        node: usize,
    },
    /// Tetrahedra whose nodes are numbered inside out, or which are mirrored.
    #[error(
        "tetrahedron {first} (counted from 0) is inverted at rest{}: exchange two nodes of {}, or mend the mesh",
        others(*count), if *count > 1 { "each" } else { "it" }
    )]
    Inverted {
        /// Their number.
        count: usize,
        /// The first of them.
        first: usize,
    },
    /// A tetrahedron so flat, small or large that its stretch cannot be measured in f32.
    #[error(
        "tetrahedron {tetrahedron} (counted from 0) is too flat, small or large for the controller's stretch check: mesh \
         the volume again, with edges of 0.01 mm to 10 m"
    )]
    Shape {
        /// The tetrahedron.
        tetrahedron: usize,
    },
    /// Cells of a lattice so thin, small or large that their stretch cannot be measured in f32.
    #[error(
        "the lattice's cells are too thin, small or large for the controller's stretch check: give fewer of them, or the \
         unit of the surface's file (--unit)"
    )]
    CellShape,
    /// Parts that no shared node connects.
    #[error("the volume has {parts} parts that share no node: join them, or build a tree for each")]
    Apart {
        /// Their number.
        parts: usize,
    },
    /// Vertices of the surface that are in no tetrahedron.
    #[error(
        "vertex {first} (counted from 0) of the surface is outside the volume{}, by up to {distance:.3} mm: give a volume \
         that holds the surface, in its unit and coordinates, or bind vertices within that distance (--bind-within)",
        others(*count)
    )]
    Outside {
        /// Their number.
        count: usize,
        /// The first of them.
        first: usize,
        /// The largest distance from the volume (mm).
        distance: f64,
    },
    /// A thin tetrahedron would extrapolate to this vertex so far that errors of its nodes grow threefold.
    #[error(
        "vertex {vertex} (counted from 0) of the surface is {distance:.3} mm outside of a tetrahedron that is about as thin, \
         too far to bind it (--bind-within): mesh the volume coarser there, or let it hold the vertex"
    )]
    Lever {
        /// The first such vertex.
        vertex: usize,
        /// Its distance from the volume (mm).
        distance: f64,
    },
    /// A lattice without cells, or with too many.
    #[error(
        "a lattice of {0} x {1} x {2} cells cannot be stored: 1 to 10,922 cells in all are possible", cells[0], cells[1],
        cells[2]
    )]
    Cells {
        /// Cells along each axis.
        cells: [u32; 3],
    },
}

/// The elements besides the named one of which the same is true.
fn others(count: usize) -> String {
    match count {
        ..=1 => String::new(),
        2 => ", and so is 1 other".to_owned(),
        count => format!(", and so are {} others", count - 1),
    }
}

impl Volume {
    /// A volume of these nodes, in millimetres and the coordinates of the surface's file, and tetrahedra of them. Seen
    /// from the fourth node of each, the first three run counterclockwise: as VTK and Gmsh number them.
    ///
    /// # Errors
    /// [`VolumeError`] names the first defect.
    pub fn new(nodes: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, VolumeError> {
        let volume = Self { nodes, tetrahedra, is_box: false, within: 0.0 };
        volume.check().map(|()| volume)
    }

    /// A lattice of cells around a mesh, each cut into six tetrahedra, with a margin of a thousandth of its size.
    ///
    /// # Errors
    /// [`VolumeError::Cells`] for no cells, or too many; the builder refuses cells too small or large.
    pub fn lattice(mesh: &Mesh, cells: [u32; 3]) -> Result<Self, VolumeError> {
        let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        // Vertices of no triangle may be anywhere.
        let corners = mesh.triangles.iter().flatten();
        let positions = corners.filter_map(|&vertex| mesh.positions.get(vertex as usize));
        let [low, high] = positions.fold(bounds, |[low, high], position| {
            let position = position.as_dvec3();
            [low.min(position), high.max(position)]
        });
        let product = |added: u64| {
            let along = cells.iter().map(|&cells| u64::from(cells) + added);
            along.fold(1, u64::saturating_mul)
        };
        let (count, nodes) = (product(0), product(1));
        let is_possible = (1..=u64::from(MAX_ELEMENTS / 6)).contains(&count);
        if !is_possible || nodes > u64::from(MAX_NODES) || !(low.is_finite() && high.is_finite()) {
            return Err(VolumeError::Cells { cells });
        }
        let margin = DVec3::splat((high - low).max_element() / 1_000.0);
        let (low, high) = (mesh.origin + low - margin, mesh.origin + high + margin);
        let cells = UVec3::from(cells);
        let points = cells + 1;
        let at = |point: UVec3| {
            let part = point.as_dvec3() / cells.as_dvec3();
            low + (high - low) * part
        };
        let nodes = grid(points).map(at).collect();
        let number = |p: UVec3| p.x + points.x * (p.y + points.y * p.z);
        // All six tetrahedra of a cell contain its diagonal, so that the faces of neighbouring cells match.
        let tetrahedra = grid(cells).flat_map(|cell| {
            ORDERS.map(|order| {
                let mut corner = cell;
                let [b, c, d] = order.map(|axis| {
                    corner[axis] += 1;
                    number(corner)
                });
                let is_even = matches!(order, [0, 1, 2] | [1, 2, 0] | [2, 0, 1]);
                if is_even { [number(cell), b, c, d] } else { [number(cell), c, b, d] }
            })
        });
        let tetrahedra = tetrahedra.collect();
        let volume = Self { nodes, tetrahedra, is_box: true, within: 0.0 };
        volume.check().map(|()| volume)
    }

    /// Binds vertices of a surface that are outside, within this distance (mm), to the nearest tetrahedron, whose
    /// deformation is extrapolated to them. Vertices farther outside are still refused.
    ///
    /// Such a vertex moves farther than the nodes, and so do their errors, by the factor
    /// [`amplification`](dibs_nostd::nodes::Nodes::amplification). A vertex with a factor of three is refused; it is
    /// about as far outside as the tetrahedron is high. If any vertex is outside, weights have 14 bits instead of 16.
    #[must_use]
    pub fn bind_within(mut self, distance: f64) -> Self {
        self.within = distance;
        self
    }

    /// Its nodes.
    #[must_use]
    pub fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    /// The nodes of its tetrahedra.
    #[must_use]
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.tetrahedra
    }

    /// Nodes in f32, relative to an origin, and faces of the tetrahedra: motions of the nodes are checked against it.
    pub(crate) fn skeleton(&self, origin: DVec3) -> Mesh {
        let positions = self.nodes.iter().map(|&node| (node - origin).as_vec3()).collect();
        let faces = self.tetrahedra.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [b, c, d]]);
        Mesh { origin, positions, triangles: faces.collect() }
    }

    pub(super) const fn within(&self) -> f64 {
        self.within
    }

    pub(super) const fn is_box(&self) -> bool {
        self.is_box
    }

    fn check(&self) -> Result<(), VolumeError> {
        let (nodes, tetrahedra) = (self.nodes.len(), self.tetrahedra.len());
        let is_possible = (4..=MAX_NODES as usize).contains(&nodes)
            && (1..=MAX_ELEMENTS as usize).contains(&tetrahedra);
        if !is_possible {
            return Err(VolumeError::Size { nodes, tetrahedra });
        }
        if let Some(node) = self.nodes.iter().position(|node| !node.is_finite()) {
            return Err(VolumeError::Coordinate { node });
        }
        for (tetrahedron, corners) in self.tetrahedra.iter().enumerate() {
            if let Some(&node) = corners.iter().find(|&&node| node as usize >= nodes) {
                return Err(VolumeError::Corner { tetrahedron, node, nodes });
            }
        }
        let shape = |corners: &[u32; 4]| edges(corners.map(|node| self.nodes[node as usize]));
        let is_inverted = |corners: &[u32; 4]| shape(corners).determinant() < 0.0;
        let mut inverted = (0..tetrahedra).filter(|&at| is_inverted(&self.tetrahedra[at]));
        if let Some(first) = inverted.next() {
            return Err(VolumeError::Inverted { count: 1 + inverted.count(), first });
        }
        let parts = self.parts();
        if parts > 1 {
            return Err(VolumeError::Apart { parts });
        }
        Ok(())
    }

    /// Sets of tetrahedra that share nodes.
    fn parts(&self) -> usize {
        let mut sets = petgraph::unionfind::UnionFind::<u32>::new(self.nodes.len());
        for &[a, b, c, d] in &self.tetrahedra {
            [b, c, d].into_iter().for_each(|other| {
                sets.union(a, other);
            });
        }
        let mut parts: Vec<u32> = self.tetrahedra.iter().map(|&[a, ..]| sets.find(a)).collect();
        parts.sort_unstable();
        parts.dedup();
        parts.len()
    }
}

/// The axes in the six orders in which a path along a cell's edges can go from its first corner to its last.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The points of a grid, x first.
fn grid(size: UVec3) -> impl Iterator<Item = UVec3> {
    let layer =
        move |z| (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec3::new(x, y, z)));
    (0..size.z).flat_map(layer)
}

/// The largest singular value of the deformation gradient that maps the edges at rest to the edges now.
pub(crate) fn largest_stretch(rest: DMat3, now: DMat3) -> f64 {
    let gradient = now * rest.inverse();
    let [a, b, c] = [gradient.x_axis, gradient.y_axis, gradient.z_axis];
    let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
    let (ab, ac, bc) = (a.dot(b), a.dot(c), b.dot(c));
    // The largest root of the characteristic polynomial of `F^T F`, whose roots are all real.
    let mean = (aa + bb + cc) / 3.0;
    let (x, y, z) = (aa - mean, bb - mean, cc - mean);
    let size = ((x * x + y * y + z * z) / 6.0 + (ab * ab + ac * ac + bc * bc) / 3.0).sqrt();
    let determinant = x * (y * z - bc * bc) - ab * (ab * z - bc * ac) + ac * (ab * bc - y * ac);
    let cosine = (determinant / (2.0 * size.powi(3))).clamp(-1.0, 1.0);
    // For a gradient that is a rotation, the cosine is NaN.
    let spread = if size > 0.0 { 2.0 * size * (cosine.acos() / 3.0).cos() } else { 0.0 };
    (mean + spread).sqrt()
}

/// The edges along the path through four nodes.
pub(crate) fn edges([a, b, c, d]: [DVec3; 4]) -> DMat3 {
    DMat3::from_cols(b - a, c - b, d - c)
}

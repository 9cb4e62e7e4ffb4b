//! The one check of frames against a tree, for files, arrays and live sources.

// Requirement: M-06

use std::collections::HashMap;

use dibs_nostd::format::Unit;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, Tree, TriangleRow};
use glam::Vec3;

use crate::Mesh;
use crate::faces::first_without_face;

/// Why positions are not a frame of a tree's surface.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Too few or too many positions.
    #[error(
        "has {found} vertices and the tree's mesh has {expected}: give the positions of the mesh that the tree was built \
         from, one for each vertex of its file"
    )]
    Vertices {
        /// Vertices of the mesh's file.
        expected: usize,
        /// Positions of the frame.
        found: usize,
    },
    /// Too few or too many positions of nodes.
    #[error(
        "has {found} points and the tree has {expected} nodes: give the nodes of the volume that the tree was built with, \
         one for each point of its file"
    )]
    Nodes {
        /// Nodes of the tree.
        expected: usize,
        /// Positions of the frame.
        found: usize,
    },
    /// Its triangles are not those of the tree.
    #[error(
        "has no face with the vertices {0}, {1} and {2} (counted from 0), which are a triangle of the tree: it is of another \
         mesh, or numbers its vertices otherwise, as STL does, which has no numbers", corners[0], corners[1], corners[2]
    )]
    Triangle {
        /// The corners of a triangle of the tree, by the mesh's numbers.
        corners: [u32; 3],
    },
    /// It is far smaller or larger than the rest shape.
    #[error(
        "has edges {ratio:.3e} times as long as at rest: it is in another unit{}, or of another mesh",
        of_unit(*unit)
    )]
    Size {
        /// Length of its edges (root mean square) over their length at rest.
        ratio: f64,
        /// The unit of the mesh's file, if known.
        unit: Option<Unit>,
    },
    /// A tetrahedron of a volume is turned inside out, or flat.
    #[error(
        "turns the tetrahedron {tetrahedron} (nodes {}; all counted from 0) inside out, or flat: no stretch limit admits that, \
         mend the frame",
        numbers(nodes)
    )]
    Inverted {
        /// The first such tetrahedron, counted from 0.
        tetrahedron: usize,
        /// Its nodes.
        nodes: [u32; 4],
    },
    /// A closed surface is turned inside out, so that inside and outside are exchanged.
    #[error(
        "is inside out: its volume is {part:.3} times that at rest; an axis is mirrored or two are exchanged, in the mesh or \
         in the frame: convert both in the same way"
    )]
    InsideOut {
        /// The signed volume that it encloses over the volume at rest.
        part: f64,
    },
}

/// Numbers in one line.
pub(crate) fn numbers(numbers: &[u32]) -> String {
    numbers.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

fn of_unit(unit: Option<Unit>) -> String {
    unit.map_or_else(String::new, |unit| {
        format!(" (--unit states its own; the mesh's file is in {unit}, as in --unit {unit})")
    })
}

/// Least length of a frame's edges over their length at rest: the default of a receiver's limit on shrinkage.
const LEAST: f64 = 0.25;

/// Largest such ratio, or twice the stretch limit if that is larger.
const MOST: f64 = 4.0;

/// Largest such ratio for frames that limits are learned from: less than the factor between two units.
const MOST_LEARNED: f64 = 8.0;

/// Rounding may change the sign of a flat surface's volume: up to this fraction of the volume at rest, a receiver's
/// tolerance, it may be negative.
const FLAT: f64 = 1.0 / 64.0;

/// Least volume at rest whose sign is significant, as a fraction of the sum of its terms' magnitudes.
const LEAST_VOLUME: f64 = 1.0 / 4096.0;

/// Checks frames against a tree, and reorders their positions into the tree's rows. For a tree with
/// [nodes](dibs_nostd::nodes) a frame holds the nodes' positions, in the order of the volume's file.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameCheck {
    /// The mesh vertex of each row.
    order: Vec<u32>,
    /// Corners of the tree's triangles, by the mesh's numbers; for nodes, corners of two faces of each tetrahedron.
    triangles: Vec<[u32; 3]>,
    /// Whether frames hold nodes instead of vertices.
    is_of_nodes: bool,
    /// Vertices of the mesh's file.
    vertices: usize,
    rest: AtRest,
}

impl FrameCheck {
    /// The check for frames of this tree.
    #[must_use]
    pub fn of<I: Index>(tree: &Tree<'_, I>) -> Self {
        if let Ok(nodes) = Nodes::of(tree) {
            return Self::of_nodes(&nodes, tree.unit());
        }
        let number = |row| tree.vertex_number(row).map_or(row, |number| number.0);
        // Without the mesh's numbers, positions are expected in the order of the rows.
        let has_order = tree.vertex_number(0).is_some();
        let order: Vec<u32> = (0..tree.vertex_count()).map(number).collect();
        let rows = (0..tree.triangle_count()).filter_map(|row| tree.corners(TriangleRow(row)));
        let rows: Vec<[u32; 3]> = rows.collect();
        let at_rest = |row| tree.rest_position(row);
        let has_neighbours =
            |row| (0..3).all(|edge| tree.neighbour(TriangleRow(row), edge).is_some());
        let is_closed = (0..tree.triangle_count()).all(has_neighbours);
        let most = (2.0 * f64::from(tree.stretch())).max(MOST);
        Self {
            triangles: rows.iter().map(|corners| corners.map(number)).collect(),
            is_of_nodes: false,
            order,
            vertices: if has_order { tree.file_vertex_count() } else { tree.vertex_count() }
                as usize,
            rest: AtRest::of(&rows, at_rest, is_closed, most, tree.unit()),
        }
    }

    fn of_nodes(nodes: &Nodes<'_>, unit: Option<Unit>) -> Self {
        let elements = (0..nodes.element_count()).filter_map(|element| nodes.element(element));
        let triangles: Vec<[u32; 3]> =
            elements.flat_map(|[a, b, c, d]| [[a, b, c], [b, c, d]]).collect();
        let most = (2.0 * f64::from(nodes.stretch_limit())).max(MOST);
        let at_rest = |node| nodes.rest_position(node);
        Self {
            order: (0..nodes.count()).collect(),
            // The check tests each tetrahedron's sign by itself.
            rest: AtRest::of(&triangles, at_rest, false, most, unit),
            triangles,
            is_of_nodes: true,
            vertices: nodes.count() as usize,
        }
    }

    /// The mesh's vertex, or the node, of each row.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Corners of the tree's triangles, by the mesh's numbers. Empty for frames of nodes.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        if self.is_of_nodes { &[] } else { &self.triangles }
    }

    pub(crate) const fn is_of_nodes(&self) -> bool {
        self.is_of_nodes
    }

    /// Positions of a frame: the vertices of the mesh's file, or the nodes.
    #[must_use]
    pub const fn positions(&self) -> usize {
        self.vertices
    }

    /// Takes a frame's positions in the mesh's order (mm) and returns them in the order of the tree's rows.
    ///
    /// # Errors
    /// [`FrameError`] for another number of vertices, another size, and a closed surface that is inside out.
    pub fn to_rows(&self, positions: &[Vec3]) -> Result<Vec<Vec3>, FrameError> {
        let mut rows = Vec::new();
        self.to_rows_in(positions, &mut rows)?;
        Ok(rows)
    }

    /// As [`to_rows`](Self::to_rows), into a vector of the caller's, which is cleared first.
    ///
    /// # Errors
    /// As [`to_rows`](Self::to_rows).
    pub fn to_rows_in(&self, positions: &[Vec3], rows: &mut Vec<Vec3>) -> Result<(), FrameError> {
        rows.clear();
        if positions.len() != self.vertices {
            let (expected, found) = (self.vertices, positions.len());
            return Err(if self.is_of_nodes {
                FrameError::Nodes { expected, found }
            } else {
                FrameError::Vertices { expected, found }
            });
        }
        let at = |vertex: u32| positions.get(vertex as usize).copied();
        self.rest.check(&self.triangles, at)?;
        rows.extend(self.order.iter().filter_map(|&vertex| at(vertex)));
        if rows.len() != self.order.len() {
            let (expected, found) = (self.vertices, positions.len());
            return Err(FrameError::Vertices { expected, found });
        }
        Ok(())
    }

    /// Checks that each triangle of the tree is one of these faces, or a part of one. A file without faces passes, and so do
    /// nodes.
    ///
    /// # Errors
    /// [`FrameError::Triangle`] names the first that is not.
    pub fn check_faces(&self, faces: &[Vec<u32>]) -> Result<(), FrameError> {
        let faces = if self.is_of_nodes { &[] } else { faces };
        check_faces(&self.triangles, self.vertices, faces)
    }
}

/// Checks that each triangle is one of these faces, or a part of one, if there are any.
pub(crate) fn check_faces(
    triangles: &[[u32; 3]],
    vertices: usize,
    faces: &[Vec<u32>],
) -> Result<(), FrameError> {
    if faces.is_empty() {
        return Ok(());
    }
    match first_without_face(triangles, vertices, faces) {
        Some(missing) => Err(FrameError::Triangle { corners: triangles[missing] }),
        None => Ok(()),
    }
}

/// What frames are compared with: size and volume of the rest shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AtRest {
    /// The sum of the squares of all edges, if the rest shape is known.
    squares: Option<f64>,
    /// The volume, if the surface is closed and the volume's sign is significant.
    volume: Option<f64>,
    /// Largest length of a frame's edges over their length at rest.
    most: f64,
    /// The unit of the mesh's file, if known.
    unit: Option<Unit>,
}

impl AtRest {
    fn of(
        triangles: &[[u32; 3]],
        at: impl Fn(u32) -> Option<Vec3> + Copy,
        is_closed: bool,
        most: f64,
        unit: Option<Unit>,
    ) -> Self {
        let volume = is_closed.then(|| volume(triangles, at)).flatten();
        let has_sign = |&(volume, terms): &(f64, f64)| volume.abs() > LEAST_VOLUME * terms;
        let volume = volume.filter(has_sign).map(|(volume, _)| volume);
        Self { squares: squares(triangles, at), volume, most, unit }
    }

    /// The shape of a mesh, before there is a tree: for frames that limits and modes are learned from.
    pub(crate) fn of_mesh(mesh: &Mesh) -> Self {
        let is_closed = is_closed(&mesh.triangles);
        Self::of(
            &mesh.triangles,
            |v| Some(mesh.positions[v as usize]),
            is_closed,
            MOST_LEARNED,
            None,
        )
    }

    /// The shape of a volume's nodes: each tetrahedron's sign has a check of its own.
    pub(crate) fn of_skeleton(skeleton: &Mesh) -> Self {
        Self { volume: None, ..Self::of_mesh(skeleton) }
    }

    /// Checks a frame's size, and that it does not turn a closed surface inside out. Positions that are not finite are
    /// left to their own error.
    pub(crate) fn check(
        &self,
        triangles: &[[u32; 3]],
        at: impl Fn(u32) -> Option<Vec3> + Copy,
    ) -> Result<(), FrameError> {
        if let (Some(rest), Some(now)) = (self.squares, squares(triangles, at)) {
            let ratio = (now / rest).sqrt();
            if ratio < LEAST || ratio > self.most && ratio.is_finite() {
                return Err(FrameError::Size { ratio, unit: self.unit });
            }
        }
        if let (Some(rest), Some((now, _))) = (self.volume, volume(triangles, at)) {
            let part = now / rest;
            if part < -FLAT {
                return Err(FrameError::InsideOut { part });
            }
        }
        Ok(())
    }
}

/// Whether triangles run along every edge as often in one direction as in the other.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut balance: HashMap<(u32, u32), i32> = HashMap::with_capacity(2 * triangles.len());
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *balance.entry((from.min(to), from.max(to))).or_default() +=
                if from < to { 1 } else { -1 };
        }
    }
    balance.into_values().all(|balance| balance == 0)
}

/// The sum of the squares of all triangles' edges; `None` where a position is missing.
fn squares(triangles: &[[u32; 3]], at: impl Fn(u32) -> Option<Vec3>) -> Option<f64> {
    let mut sum = 0.0;
    for &[a, b, c] in triangles {
        let [a, b, c] = [at(a)?, at(b)?, at(c)?].map(Vec3::as_dvec3);
        sum += a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    }
    Some(sum)
}

/// The signed volume within closed triangles, and the sum of its terms' magnitudes; `None` if a position is missing.
fn volume(triangles: &[[u32; 3]], at: impl Fn(u32) -> Option<Vec3>) -> Option<(f64, f64)> {
    let near = at(triangles.first()?[0])?.as_dvec3();
    let (mut sum, mut terms) = (0.0, 0.0);
    for &[a, b, c] in triangles {
        let [a, b, c] = [at(a)?, at(b)?, at(c)?].map(|at| at.as_dvec3() - near);
        let term = a.dot(b.cross(c)) / 6.0;
        sum += term;
        terms += term.abs();
    }
    Some((sum, terms))
}

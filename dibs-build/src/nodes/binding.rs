//! The binding of a surface's vertices to the tetrahedra of a volume.

use dibs_nostd::nodes::{MOST_SIZES, SIGNED_ZERO, STEP, WHOLE};
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::encode::least_limit;
use super::paths::VolumePaths;
use super::{Volume, VolumeError};
use crate::Mesh;
use crate::rounding::round_up;

/// A surface bound to a volume: for each vertex its tetrahedron, and the weights of its nodes.
#[derive(Debug)]
pub(crate) struct Embedding {
    /// The nodes as a tree stores them.
    pub nodes: Vec<Vec3>,
    /// The tetrahedra ordered by their last node, which is the order in which frames complete them.
    pub tetrahedra: Vec<[u32; 4]>,
    /// The volume's index of each tetrahedron.
    order: Vec<usize>,
    /// The limit of each tetrahedron over the tree's; empty if all have the tree's limit.
    ratios: Vec<f64>,
    pub is_box: bool,
    pub vertices: Vec<Bound>,
    /// Whether any vertex is outside of its tetrahedron, so that weights are signed.
    pub is_signed: bool,
    /// Largest distance (mm) of a vertex from its position in the mesh, caused by rounding its weights.
    pub error: f64,
}

/// A bound vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    pub tetrahedron: u32,
    /// Fractions in units of 1 / [`WHOLE`], whose sum is 1. Each fits the 16 bits of a [stored](Embedding::stored)
    /// weight.
    pub weights: [i32; 4],
}

impl Bound {
    /// Whether the vertex is outside of its tetrahedron.
    pub fn is_outside(&self) -> bool {
        self.weights.iter().any(|&weight| weight < 0)
    }

    /// The sum of the weights' magnitudes.
    fn sizes(&self) -> u32 {
        self.weights.iter().map(|weight| weight.unsigned_abs()).sum()
    }
}

/// The tetrahedron that a vertex is bound to, its barycentric coordinates there, and its distance from it.
#[derive(Clone, Copy, Debug)]
struct Location {
    tetrahedron: u32,
    weights: [f64; 4],
    distance: f64,
}

impl Location {
    /// For a vertex that no triangle uses.
    const NONE: Self = Self { tetrahedron: 0, weights: [0.0, 0.0, 0.0, 1.0], distance: 0.0 };
}

impl Embedding {
    /// Binds each vertex of the mesh.
    pub fn new(volume: &Volume, mesh: &Mesh) -> Result<Self, VolumeError> {
        let nodes: Vec<Vec3> =
            volume.nodes().iter().map(|&node| (node - mesh.origin).as_vec3()).collect();
        let mut order: Vec<usize> = (0..volume.tetrahedra().len()).collect();
        order.sort_by_key(|&number| volume.tetrahedra()[number].into_iter().max());
        let tetrahedra: Vec<[u32; 4]> =
            order.iter().map(|&number| volume.tetrahedra()[number]).collect();
        let cells: Vec<Cell> =
            tetrahedra.iter().map(|&corners| Cell::new(&nodes, corners)).collect();
        let grid = Grid::new(&cells);
        // A vertex of no triangle may be anywhere.
        let mut is_used = vec![false; mesh.positions.len()];
        mesh.triangles.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
        let place = |(position, is_used): (&Vec3, &bool)| match is_used {
            true => grid.place_of(&cells, position.as_dvec3()),
            false => Location::NONE,
        };
        let places: Vec<Location> = mesh.positions.par_iter().zip(&is_used).map(place).collect();
        // Written so that a distance of NaN counts as beyond.
        let is_beyond =
            |place: &&Location| place.distance > 0.0 && !(place.distance <= volume.within());
        if let Some(first) = places.iter().position(|place| is_beyond(&place)) {
            let count = places.iter().filter(is_beyond).count();
            let distance = places.iter().map(|place| place.distance).fold(0.0, f64::max);
            return Err(VolumeError::Outside { count, first, distance });
        }
        let is_signed = places.iter().any(|place| place.distance > 0.0);
        let bind = |&Location { tetrahedron, weights, distance }: &Location| Bound {
            tetrahedron,
            weights: match (is_signed, distance > 0.0) {
                (false, _) => rounded(weights.map(|weight| weight.clamp(0.0, 1.0)), 1),
                (true, false) => rounded(weights.map(|weight| weight.clamp(0.0, 1.0)), STEP),
                (true, true) => rounded(weights, STEP),
            },
        };
        let vertices: Vec<Bound> = places.iter().map(bind).collect();
        if let Some(vertex) = vertices.iter().position(|bound| bound.sizes() >= MOST_SIZES) {
            let distance = places[vertex].distance;
            return Err(VolumeError::Lever { vertex, distance });
        }
        // Lines to a vertex outside leave the box.
        let is_box = volume.is_box() && !is_signed;
        let ratios = Vec::new();
        let mut embedding =
            Self { nodes, tetrahedra, order, ratios, is_box, vertices, is_signed, error: 0.0 };
        let moved = mesh.positions.iter().zip(embedding.positions());
        let moved = moved.map(|(position, at)| position.as_dvec3().distance(at));
        let moved = moved.zip(is_used).filter(|(_, is_used)| *is_used);
        embedding.error = moved.map(|(moved, _)| moved).fold(0.0, f64::max);
        Ok(embedding)
    }

    /// Limits the stretch of all tetrahedra, or of each by the volume's numbers. Returns the tree's limit: the largest.
    /// Limits are raised to the least that the controller can tell from the rest shape.
    pub fn limit(&mut self, stretch: f32, limits: Option<&[f32]>) -> Result<f32, VolumeError> {
        let mut own = Vec::new();
        for (tetrahedron, &number) in self.order.iter().enumerate() {
            let corners = self.tetrahedra[tetrahedron].map(|node| self.nodes[node as usize]);
            let least = least_limit(corners.map(Vec3::as_dvec3));
            let least = least.ok_or_else(|| self.unmeasurable(tetrahedron))?;
            own.push(limits.map_or(stretch, |limits| limits[number]).max(round_up(least)));
        }
        let most = own.iter().copied().fold(1.0, f32::max);
        if limits.is_some() && own.iter().any(|&limit| limit < most) {
            let part = |limit: f32| f64::from(limit) / f64::from(most);
            self.ratios = own.into_iter().map(part).collect();
        }
        Ok(most)
    }

    /// Whether all tetrahedra have the tree's limit.
    pub fn is_uniform(&self) -> bool {
        self.ratios.is_empty()
    }

    /// A tetrahedron's limit over the tree's.
    pub fn ratio(&self, tetrahedron: u32) -> f64 {
        self.ratios.get(tetrahedron as usize).copied().unwrap_or(1.0)
    }

    /// The error for a tetrahedron whose stretch the controller cannot measure.
    pub fn unmeasurable(&self, tetrahedron: usize) -> VolumeError {
        if self.is_box {
            return VolumeError::CellShape;
        }
        VolumeError::Shape { tetrahedron: self.order[tetrahedron] }
    }

    /// A weight as a tree stores it.
    pub const fn stored(&self, weight: i32) -> u16 {
        let signed = weight / STEP as i32 + SIGNED_ZERO as i32;
        (if self.is_signed { signed } else { weight }) as u16
    }

    /// The rest positions of the vertices, computed from the weights.
    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        self.vertices.iter().map(|bound| {
            let corners = self.tetrahedra[bound.tetrahedron as usize];
            let terms = corners.into_iter().zip(bound.weights);
            let sum: DVec3 = terms
                .map(|(node, weight)| self.nodes[node as usize].as_dvec3() * f64::from(weight))
                .sum();
            sum / f64::from(WHOLE)
        })
    }

    /// The same surface with these rest positions.
    pub fn mesh(&self, mesh: &Mesh) -> Mesh {
        let positions = self.positions().map(DVec3::as_vec3).collect();
        Mesh { origin: mesh.origin, positions, triangles: mesh.triangles.clone() }
    }

    /// The distances through the volume.
    pub fn paths(&self) -> VolumePaths<'_> {
        VolumePaths::new(self)
    }
}

impl Volume {
    /// Checks that it can move a surface: that it holds the vertices, or they are near enough to
    /// [bind](Self::bind_within).
    ///
    /// # Errors
    /// [`VolumeError::Outside`] and [`VolumeError::Lever`], as of [`Builder::build`](crate::Builder::build).
    ///
    /// # Panics
    /// If the mesh names vertices that it does not have.
    pub fn check_surface(&self, mesh: &Mesh) -> Result<(), VolumeError> {
        Embedding::new(self, mesh).map(|_| ())
    }
}

/// A tetrahedron, prepared for locating points.
#[derive(Debug)]
pub(super) struct Cell {
    pub corners: [DVec3; 4],
    /// Maps a position relative to the first corner to the weights of the other three.
    inverse: DMat3,
}

impl Cell {
    pub fn new(nodes: &[Vec3], corners: [u32; 4]) -> Self {
        let corners = corners.map(|node| nodes[node as usize].as_dvec3());
        let [a, b, c, d] = corners;
        Self { corners, inverse: DMat3::from_cols(b - a, c - a, d - a).inverse() }
    }

    /// The barycentric coordinates of a position.
    pub fn weights(&self, position: DVec3) -> [f64; 4] {
        let DVec3 { x, y, z } = self.inverse * (position - self.corners[0]);
        [1.0 - x - y - z, x, y, z]
    }

    fn bounds(&self) -> [DVec3; 2] {
        let [a, b, c, d] = self.corners;
        [a.min(b).min(c).min(d), a.max(b).max(c).max(d)]
    }

    /// The distance from the tetrahedron to a position outside.
    fn distance(&self, position: DVec3) -> f64 {
        let [a, b, c, d] = self.corners;
        let faces = [[a, b, c], [a, b, d], [a, c, d], [b, c, d]];
        faces.iter().map(|face| to_triangle(position, *face)).fold(f64::INFINITY, f64::min)
    }
}

/// A uniform grid that finds the tetrahedra near a position.
struct Grid {
    low: DVec3,
    /// Cells a millimetre.
    per_mm: DVec3,
    size: [usize; 3],
    /// The tetrahedra whose bounding box meets each cell.
    cells: Vec<Vec<u32>>,
}

impl Grid {
    fn new(tetrahedra: &[Cell]) -> Self {
        let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = tetrahedra
            .iter()
            .map(Cell::bounds)
            .fold(bounds, |[low, high], [a, b]| [low.min(a), high.max(b)]);
        let side = (tetrahedra.len() as f64).cbrt().ceil().max(1.0);
        let per_mm = DVec3::splat(side) / (high - low);
        let size = [side as usize; 3];
        let mut grid = Self { low, per_mm, size, cells: vec![Vec::new(); size.iter().product()] };
        for (number, cell) in (0..).zip(tetrahedra) {
            let [from, to] = cell.bounds().map(|corner| grid.place(corner));
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    for x in from[0]..=to[0] {
                        let at = grid.row([x, y, z]);
                        grid.cells[at].push(number);
                    }
                }
            }
        }
        grid
    }

    fn place(&self, position: DVec3) -> [usize; 3] {
        let at = ((position - self.low) * self.per_mm).to_array();
        let mut place = [0; 3];
        for (axis, place) in place.iter_mut().enumerate() {
            *place = (at[axis].max(0.0) as usize).min(self.size[axis] - 1);
        }
        place
    }

    const fn row(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// The tetrahedron around a position, or the nearest one; of equally near ones the one that extrapolates least.
    fn place_of(&self, tetrahedra: &[Cell], position: DVec3) -> Location {
        let near = &self.cells[self.row(self.place(position))];
        let least = |weights: &[f64; 4]| weights.iter().copied().fold(f64::INFINITY, f64::min);
        let weights = near.iter().map(|&at| (at, tetrahedra[at as usize].weights(position)));
        let inner = weights.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1)).then(b.0.cmp(&a.0)));
        match inner {
            Some((tetrahedron, weights)) if least(&weights) >= -OUTSIDE => {
                Location { tetrahedron, weights, distance: 0.0 }
            }
            _ => {
                let sizes = |place: &Location| place.weights.iter().map(|w| w.abs()).sum::<f64>();
                let nearer = |nearest: Location, (tetrahedron, cell): (u32, &Cell)| {
                    let [low, high] = cell.bounds();
                    let as_near = nearest.distance * (1.0 + 1e-9);
                    if position.clamp(low, high).distance(position) > as_near {
                        return nearest;
                    }
                    let (weights, distance) = (cell.weights(position), cell.distance(position));
                    let place = Location { tetrahedron, weights, distance };
                    let is_nearer = distance * (1.0 + 1e-9) < nearest.distance
                        || distance <= as_near && sizes(&place) < sizes(&nearest);
                    if is_nearer { place } else { nearest }
                };
                let none = Location { distance: f64::INFINITY, ..Location::NONE };
                (0..).zip(tetrahedra).fold(none, nearer)
            }
        }
    }
}

/// A vertex farther outside than this, in barycentric coordinates, counts as outside: one unit of a weight.
const OUTSIDE: f64 = 1.0 / WHOLE as f64;

/// Barycentric coordinates as multiples of `step` in units of 1 / [`WHOLE`], with an exact sum; each is off by one step
/// at most.
fn rounded(weights: [f64; 4], step: u32) -> [i32; 4] {
    let whole = (WHOLE / step) as i32;
    let exact = weights.map(|weight| weight * f64::from(whole));
    let mut rounded = exact.map(|weight| weight.floor() as i32);
    let mut order = [0, 1, 2, 3];
    let part = |at: usize| exact[at] - exact[at].floor();
    order.sort_by(|&i, &j| part(j).total_cmp(&part(i)));
    for at in order.into_iter().cycle().take(16) {
        let sum: i32 = rounded.iter().sum();
        match sum.cmp(&whole) {
            std::cmp::Ordering::Less => rounded[at] += 1,
            std::cmp::Ordering::Equal => break,
            // Weights that are not negative stay so.
            std::cmp::Ordering::Greater => rounded[at] -= i32::from(rounded[at] != 0),
        }
    }
    // A stored weight has 16 bits, so none may be the whole: the stretch check decides which three are stored.
    if let Some(at) = rounded.iter().position(|&weight| weight == WHOLE as i32) {
        (rounded[at], rounded[(at + 1) % 4]) = (WHOLE as i32 - 1, 1);
    }
    rounded.map(|weight| weight * step as i32)
}

/// The distance of a point from a triangle.
fn to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let to_edge = |a: DVec3, b: DVec3| {
        let along = (b - a).dot(p - a) / (b - a).length_squared();
        p.distance(a + (b - a) * along.clamp(0.0, 1.0))
    };
    let normal = (b - a).cross(c - a);
    let is_over = [[a, b], [b, c], [c, a]]
        .iter()
        .all(|[from, to]| (*to - *from).cross(p - *from).dot(normal) >= 0.0);
    if is_over && normal != DVec3::ZERO {
        return (p - a).dot(normal).abs() / normal.length();
    }
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

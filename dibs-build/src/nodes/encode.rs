//! The nodes of a tree as bytes: section 11 of `dibs-nostd`'s `docs/format.md`.

use dibs_nostd::nodes::{HEADER_BYTES, LEAST_VOLUME, MARGIN, MARKS, Nodes, SIGNED_ZERO};
use glam::{DMat3, DVec3, Vec3};

use super::VolumeError;
use super::binding::Embedding;
use super::volume::edges;
use crate::rounding::{round_down, round_up};

/// The section of a tree with this stretch limit whose rows hold the mesh vertices `order`.
pub(crate) fn encode(
    embedding: &Embedding,
    stretch: f32,
    order: &[u32],
) -> Result<Vec<u8>, VolumeError> {
    let shapes = shapes(embedding, stretch)?;
    let longest = shapes.iter().map(Shape::longest).fold(0.0, f64::max);
    let mut bytes = Vec::new();
    bytes.extend((embedding.nodes.len() as u32).to_le_bytes());
    bytes.extend((shapes.len() as u32).to_le_bytes());
    bytes.extend(round_up(embedding.paths().extent(shapes[0].corners[0])).to_le_bytes());
    bytes.extend(round_up(longest).to_le_bytes());
    let zero = if embedding.is_signed { SIGNED_ZERO } else { 0 };
    bytes.extend(zero.to_le_bytes());
    bytes.resize(HEADER_BYTES, 0);
    for node in &embedding.nodes {
        node.to_array().into_iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    for shape in &shapes {
        shape.corners.into_iter().for_each(|node| bytes.extend((node as u16).to_le_bytes()));
        shape.numbers(stretch).into_iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    }
    let mut marks = vec![0_u32; embedding.nodes.len().div_ceil(MARKS as usize)];
    for &vertex in order {
        let bound = &embedding.vertices[vertex as usize];
        bytes.extend((bound.tetrahedron as u16).to_le_bytes());
        // The weights in the order of the tetrahedron's corners in the stretch check.
        let corners = embedding.tetrahedra[bound.tetrahedron as usize];
        let of =
            |node: u32| (0..4).find(|&at| corners[at] == node).map_or(0, |at| bound.weights[at]);
        let [a, b, c, _] = shapes[bound.tetrahedron as usize].corners;
        [a, b, c]
            .into_iter()
            .for_each(|node| bytes.extend(embedding.stored(of(node)).to_le_bytes()));
        for (node, weight) in corners.into_iter().zip(bound.weights) {
            if weight != 0 {
                marks[(node / MARKS) as usize] |= 1 << (node % MARKS);
            }
        }
    }
    marks.into_iter().for_each(|word| bytes.extend(word.to_le_bytes()));
    Ok(bytes)
}

/// The least stretch limit of a tetrahedron that the controller can tell from the rest shape; `None` for a flat one.
pub(crate) fn least_limit(corners: [DVec3; 4]) -> Option<f64> {
    let (_, _, openness) = path(corners);
    let least = (1.0 + 3.0 * MARGIN / openness).sqrt() * (1.0 + 1.0 / 65_536.0);
    (openness >= FLAT).then_some(least)
}

/// The least limit of any tetrahedron of a built volume; the tree's, if all have that.
pub(crate) fn least_stretch_limit(nodes: &Nodes<'_>) -> f32 {
    let limits = (0..nodes.element_count()).filter_map(|element| own_limit(nodes, element));
    limits.fold(nodes.stretch_limit(), f32::min)
}

/// The limit of a tetrahedron of a built volume that the builder was given; `None` outside the table.
pub(crate) fn own_limit(nodes: &Nodes<'_>, element: u32) -> Option<f32> {
    let corners = nodes.element(element)?.map(|node| nodes.rest_position(node));
    let [a, b, c, d] = corners.map(|corner| corner.map(Vec3::as_dvec3));
    // The stored limit is lower by the margin for rounding.
    let scale = 1.0 + MARGIN / openness(edges([a?, b?, c?, d?]));
    let own = f64::from(nodes.element_limit(element)?) * scale.sqrt();
    // Rounded to the digits that are certain: the two computations differ in the last digits.
    let own = ((own * 1e5).round() / 1e5) as f32;
    let tree = nodes.stretch_limit();
    Some(if own < tree * (1.0 - 1e-5) { own } else { tree })
}

/// A tetrahedron at rest.
struct Shape {
    corners: [u32; 4],
    /// Its edges along the path through the corners.
    edges: DMat3,
    /// The least eigenvalue of the edges' Gram matrix, scaled to a diagonal of ones.
    openness: f64,
    /// Its limit over the tree's.
    ratio: f64,
}

/// The path through four corners with the most orthogonal edges: the corners' order, the edges, and their openness.
fn path(corners: [DVec3; 4]) -> ([usize; 4], DMat3, f64) {
    let along = |order: [usize; 4]| {
        let edges = edges(order.map(|at| corners[at]));
        (order, edges, openness(edges))
    };
    let [first, others @ ..] = PATHS.map(along);
    others.into_iter().fold(first, |a, b| if b.2 > a.2 { b } else { a })
}

fn shapes(embedding: &Embedding, stretch: f32) -> Result<Vec<Shape>, VolumeError> {
    let possible = LEAST_SQUARED..=LARGEST_SQUARED / f64::from(stretch).powi(2);
    let shape = |(tetrahedron, &corners): (usize, &[u32; 4])| {
        let at = corners.map(|node| embedding.nodes[node as usize].as_dvec3());
        let (order, edges, openness) = path(at);
        let corners = order.map(|at| corners[at]);
        let ratio = embedding.ratio(tetrahedron as u32);
        let shape = Shape { corners, edges, openness, ratio };
        let volume = f64::from(shape.numbers(stretch)[6]) * 2.0;
        let is_possible = openness >= FLAT
            && edges.determinant() > volume
            && shape.squares().iter().all(|square| possible.contains(square));
        if is_possible { Ok(shape) } else { Err(embedding.unmeasurable(tetrahedron)) }
    };
    embedding.tetrahedra.iter().enumerate().map(shape).collect()
}

/// The even permutations of the corners, one for each path regardless of its direction.
const PATHS: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 0, 3, 2], [1, 2, 0, 3], [2, 0, 1, 3]];

/// Limits of squared edge lengths for which the check's products neither overflow nor underflow.
const LEAST_SQUARED: f64 = 1e-4;
const LARGEST_SQUARED: f64 = 1e8;

/// The least openness of a tetrahedron: there the check overestimates the stretch by one or two per cent.
const FLAT: f64 = 1e-4;

impl Shape {
    /// The squares of its edges, scaled by its limit ratio.
    fn squares(&self) -> [f64; 3] {
        self.columns().map(|edge| (edge * self.ratio).length_squared())
    }

    const fn columns(&self) -> [DVec3; 3] {
        [self.edges.x_axis, self.edges.y_axis, self.edges.z_axis]
    }

    /// The longest of its six edges.
    fn longest(&self) -> f64 {
        let [a, b, c] = self.columns();
        [a, b, c, a + b, b + c, a + b + c].map(DVec3::length).into_iter().fold(0.0, f64::max)
    }

    /// The numbers that the check compares with: the edges' Gram matrix, lowered by the largest rounding of the check,
    /// and the least volume. The rest shape is scaled down by its limit ratio, which scales its stretch up, so that the
    /// tree's limit serves all tetrahedra.
    fn numbers(&self, stretch: f32) -> [f32; 7] {
        let scale = 1.0 / (1.0 + MARGIN / self.openness);
        let [a, b, c] = self.columns().map(|edge| edge * self.ratio);
        let own = |edge: DVec3| round_down(edge.length_squared() * scale);
        let of = |one: DVec3, other: DVec3| (one.dot(other) * scale) as f32;
        let lengths = a.length() * b.length() * c.length();
        let least = LEAST_VOLUME * f64::from(stretch).powi(3) * lengths;
        [own(a), of(a, b), of(a, c), own(b), of(b, c), own(c), round_up(least)]
    }
}

/// The least eigenvalue of the Gram matrix of the edges scaled to unit length: the square of their least singular
/// value.
fn openness(edges: DMat3) -> f64 {
    let unit = DMat3::from_cols(
        edges.x_axis.normalize_or_zero(),
        edges.y_axis.normalize_or_zero(),
        edges.z_axis.normalize_or_zero(),
    );
    // The largest eigenvalue of the inverse, by repeated squaring; the Frobenius norm is an upper bound of it.
    let mut inverse = (unit.transpose() * unit).inverse();
    let mut scale = 0.0;
    for power in 0..6 {
        let size = inverse.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
        scale += size.ln() / f64::from(1 << power);
        inverse *= 1.0 / size;
        inverse = inverse * inverse;
    }
    let least = (-scale).exp();
    if least.is_finite() { least } else { 0.0 }
}

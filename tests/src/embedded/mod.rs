//! Surfaces that a volume moves: volumes, motions of their nodes, their stretch in f64, and climbing towards failures.

mod answers;
mod judge;
mod motions;
mod radii;
mod receiver;
mod shapes;

use dibs_nostd::format::NodeLink;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Tree, TriangleRow, VertexTable};
use glam::{DMat3, DVec3, Vec3};

pub use judge::{Tally, cover, judge};
pub use motions::{NodeMotion, gradient, nudged, pulled};
pub use radii::node_tests;
pub use shapes::{Carried, all, hull, shrunk};

/// The nodes at rest.
#[must_use]
pub fn rest(nodes: &Nodes<'_>) -> Vec<Vec3> {
    (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect()
}

/// The triangles below a node of a tree.
#[derive(Debug)]
pub struct Section {
    /// The node's pin.
    pub pin: u32,
    /// Its radius (mm).
    pub radius: f64,
    /// The rows of the section's vertices.
    pub covered: Vec<u32>,
}

/// All sections of a tree.
#[must_use]
pub fn sections(tree: &Tree<'_, u16>) -> Vec<Section> {
    let section = |row: u32| {
        let (pin, radius, _) = tree.node(row).expect("in the tree");
        let (mut below, mut covered) = (vec![row], Vec::new());
        while let Some(row) = below.pop() {
            match tree.node(row).expect("in the tree").2 {
                NodeLink::Leaf { first, count } => covered.extend(
                    (first..first + count)
                        .filter_map(|row| tree.corners(TriangleRow(row)))
                        .flatten(),
                ),
                NodeLink::Children { first, count } => below.extend(first..first + count),
            }
        }
        covered.sort_unstable();
        covered.dedup();
        Section { pin, radius: f64::from(radius), covered }
    };
    (0..tree.node_count()).map(section).collect()
}

/// The positions of all vertices, as a query reads them.
#[must_use]
pub fn rows(surface: &(impl VertexTable + ?Sized)) -> Vec<Vec3> {
    (0..surface.len() as u32).filter_map(|row| surface.position(row)).collect()
}

/// A vertex computed in f64.
#[must_use]
pub fn exact(nodes: &Nodes<'_>, table: &[Vec3], vertex: u32) -> DVec3 {
    let weights = nodes.weights(vertex).expect("in the table");
    let term = |(node, weight): (u32, i32)| table[node as usize].as_dvec3() * f64::from(weight);
    weights.map(term).into_iter().sum::<DVec3>() / 65_536.0
}

/// The largest singular value of an element's deformation gradient, and its determinant.
#[must_use]
pub fn stretch_of(rest: [Vec3; 4], now: [Vec3; 4]) -> (f64, f64) {
    let edges = |corners: [Vec3; 4]| {
        let [a, b, c, d] = corners.map(Vec3::as_dvec3);
        DMat3::from_cols(b - a, c - a, d - a)
    };
    let gradient = edges(now) * edges(rest).inverse();
    (largest_eigenvalue(gradient.transpose() * gradient).sqrt(), gradient.determinant())
}

/// The largest singular value over all elements.
#[must_use]
pub fn largest_stretch(nodes: &Nodes<'_>, table: &[Vec3]) -> f64 {
    let rest = |node| nodes.rest_position(node).expect("in the table");
    let of = |element| {
        let corners = nodes.element(element).expect("in the table");
        stretch_of(corners.map(rest), corners.map(|node| table[node as usize])).0
    };
    (0..nodes.element_count()).map(of).fold(0.0, f64::max)
}

/// By Jacobi rotations.
fn largest_eigenvalue(mut matrix: DMat3) -> f64 {
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (app, aqq, apq) = (matrix.col(p)[p], matrix.col(q)[q], matrix.col(q)[p]);
            // Far below the rounding of the diagonal.
            if apq * apq <= 1e-40 * app * aqq {
                continue;
            }
            let theta = (aqq - app) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cosine = 1.0 / t.hypot(1.0);
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = cosine;
            rotation.col_mut(q)[q] = cosine;
            rotation.col_mut(q)[p] = t * cosine;
            rotation.col_mut(p)[q] = -t * cosine;
            matrix = rotation.transpose() * matrix * rotation;
        }
    }
    (0..3).map(|at| matrix.col(at)[at]).fold(0.0, f64::max)
}

//! Distances in f64, for tests of bounds.

use glam::{DVec3, Vec3};

use crate::tree::format::NodeLink;
use crate::{Tool, Tree};

/// Distance from a tool's axis, in f64.
pub(super) fn distance(tool: &impl Tool, point: Vec3) -> f64 {
    let start = tool.axis_start().as_dvec3();
    let span: DVec3 = tool.axis_span().as_dvec3();
    let offset = point.as_dvec3() - start;
    let along = offset.dot(span) / span.length_squared().max(f64::MIN_POSITIVE);
    (offset - span * along.clamp(0.0, 1.0)).length()
}

/// The least distance of any vertex of a subtree.
pub(super) fn least(tree: &Tree<'_, u16>, link: NodeLink, far: &impl Fn(u32) -> f64) -> f64 {
    match link {
        NodeLink::Children { first, count } => (first..first + count)
            .map(|row| least(tree, tree.node(row).expect("a node").2, far))
            .fold(f64::INFINITY, f64::min),
        NodeLink::Leaf { first, count } => (first..first + count)
            .flat_map(|row| tree.triangle(row).expect("a triangle"))
            .map(far)
            .fold(f64::INFINITY, f64::min),
    }
}

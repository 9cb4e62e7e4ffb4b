//! The least stretch limits that the controller's check can enforce.
//!
//! The check is in f32 and rounds upwards: it overestimates a triangle's stretch a little. So a limit of exactly 1
//! would refuse the rest shape itself, and limits learned from a motion would refuse its frames.

use dibs_nostd::format::PathKind;
use glam::{DVec3, Vec3};

use super::RestShape;
use crate::Mesh;

/// Upper bound on the check's rounding: 21 units when the metric is stored, 21 when it is compared (`dibs_nostd`'s
/// `stretch/kernel.rs`), 2 for the marks in its bits, less a half for the root, and that of the limit itself.
const ROUNDING: f64 = 32.0 / 16_777_216.0;

/// The same factor where all triangles have one limit: neighbours then share the smaller of their rounded edges.
pub(crate) const SHARED: f64 = 1.0006;

/// The factor by which the check may overestimate the stretch of a triangle with these corners at rest, from whichever
/// corner it measures.
fn rounding(corners: [Vec3; 3], paths: PathKind) -> f64 {
    if paths == PathKind::EdgePath {
        return 1.0 + ROUNDING;
    }
    let [a, b, c] = RestShape::new(corners, paths).corners;
    let open = [openness(b - a, c - a), openness(c - b, a - b), openness(a - c, b - c)];
    // The height of a rest shape is at least 1/64 of its longest edge, which bounds the openness of its corners.
    1.0 + ROUNDING / open.into_iter().fold(1.0, f64::min).max(1e-4)
}

/// The least limit of each triangle.
pub(crate) fn least_limits(mesh: &Mesh, paths: PathKind) -> impl Iterator<Item = f64> {
    mesh.triangles.iter().map(move |&triangle| rounding(mesh.corners(triangle), paths))
}

/// `1 - |cos|` of the angle between two edges, computed without cancellation. The check's rounding grows with its
/// inverse.
pub(crate) fn openness(e1: DVec3, e2: DVec3) -> f64 {
    let lengths = e1.length() * e2.length();
    let sine = e1.cross(e2).length() / lengths;
    let openness = sine * sine / (1.0 + (e1.dot(e2) / lengths).abs());
    // An edge without length has no angle.
    if openness.is_nan() { 0.0 } else { openness }
}

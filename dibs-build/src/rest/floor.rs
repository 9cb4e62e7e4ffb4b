//! The least stretch limits that the controller's check can hold a surface to.
//!
//! The check is in f32 and rounds against the surface: it takes a triangle for stretched by a little more than it is. So a
//! limit of exactly 1 would refuse the rest shape itself, and limits learned from a motion would refuse its frames.

use dibs_nostd::format::PathKind;
use glam::{DVec3, Vec3};

use super::RestShape;
use crate::Mesh;

/// Rounding of the check, at most: 21 units when the metric is stored, 21 when it is compared (`dibs_nostd`'s
/// `stretch/kernel.rs`), 2 for its marks, less a half for the root, and those of the limit's own rounding.
const ROUNDING: f64 = 32.0 / 16_777_216.0;

/// The same where all triangles have one limit: neighbours share the lower of their roundings then.
pub(crate) const SHARED: f64 = 1.0006;

/// The factor by which the check may take the stretch of a triangle with these corners at rest for more than it is,
/// whichever corner the check measures it from.
fn rounding(corners: [Vec3; 3], paths: PathKind) -> f64 {
    if paths == PathKind::EdgePath {
        return 1.0 + ROUNDING;
    }
    let [a, b, c] = RestShape::new(corners, paths).corners;
    let open = [openness(b - a, c - a), openness(c - b, a - b), openness(a - c, b - c)];
    // A rest shape is at least 1/64 high: no corner of one is less open.
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

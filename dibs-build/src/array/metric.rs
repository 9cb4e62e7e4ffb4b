//! The metric section: what the controller needs to measure a triangle's stretch without its rest
//! shape.

use dibs_nostd::format::PathKind;
use glam::{DVec3, Vec3};

/// Rounding of the controller's check in f32, in units of 2^-24: derived in `dibs_nostd`'s
/// `stretch::kernel`, where the metric counts as divided by one more than this.
const SURFACE_ROUNDING: f64 = 20.0;
const EDGE_ROUNDING: f64 = 9.0;
const U: f64 = 1.0 / 16_777_216.0;

/// The metric of one triangle with these corners at rest, for a check whose limit is `limit` times
/// the tree's. Never too large: every rounding is downwards.
pub(crate) fn metric(corners: [Vec3; 3], limit: f64, paths: PathKind) -> [f32; 3] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let share = limit * limit;
    match paths {
        PathKind::EdgePath => {
            let edges = [b - a, c - b, c - a].map(DVec3::length_squared);
            edges.map(|squared| round_down(squared * share / (1.0 + EDGE_ROUNDING * U)))
        }
        _ => {
            let (e1, e2) = (b - a, c - a);
            let cosine = e1.dot(e2) / (e1.length() * e2.length());
            // 1 - |cosine| without its cancellation.
            let sine = e1.cross(e2).length() / (e1.length() * e2.length());
            let flatness = sine * sine / (1.0 + cosine.abs());
            let scale = share / (1.0 + SURFACE_ROUNDING * U / flatness);
            if scale.is_nan() || scale <= 0.0 {
                return [0.0; 3];
            }
            let off = (e1.dot(e2) * scale) as f32;
            [round_down(e1.length_squared() * scale), off, round_down(e2.length_squared() * scale)]
        }
    }
}

/// The nearest f32 that is not above `x`.
fn round_down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

//! The metric section: it lets the controller measure a triangle's stretch without the rest shape.

// Requirement: F-02

use dibs_nostd::format::PathKind;
use glam::{DVec3, Vec3};

use crate::rest::RestShape;
use crate::rest::openness;
use crate::rounding::round_down;

/// Rounding of the controller's check in f32, in units of 2^-24: derived in `dibs_nostd`'s
/// `stretch/kernel.rs`.
const SURFACE_ROUNDING: f64 = 21.0;
const EDGE_ROUNDING: f64 = 7.0;
const U: f64 = 1.0 / 16_777_216.0;

/// Limits of squared edge lengths for which no product of the check overflows or loses digits to underflow. (The larger
/// limit is divided by the square of the tree's limit.)
const LEAST_SQUARED: f64 = 1e-14;
const LARGEST_SQUARED: f64 = 1e18;

/// The metric of one triangle with these corners at rest, the centre first. The lowest bit of its second number holds
/// `is_reversed`.
///
/// `ratio` is its stretch limit over the tree's, which is `stretch`. Numbers are rounded down, so the metric is never
/// too large. It is all zeros, which no triangle passes, if f32 arithmetic cannot measure the triangle.
pub(crate) fn metric(
    corners: [Vec3; 3],
    is_reversed: bool,
    ratio: f64,
    stretch: f64,
    paths: PathKind,
) -> [f32; 3] {
    let [a, b, c] = RestShape::new(corners, paths).corners;
    let (e1, e2) = (b - a, c - a);
    let edges = [e1, c - b, e2].map(DVec3::length_squared);
    let possible = LEAST_SQUARED..=LARGEST_SQUARED / (stretch * stretch);
    if !edges.iter().all(|squared| possible.contains(squared)) {
        return [0.0; 3];
    }
    let ratio = ratio * ratio;
    match paths {
        PathKind::EdgePath => {
            let [first, between, second] =
                edges.map(|squared| round_down(squared * ratio / (1.0 + EDGE_ROUNDING * U)));
            [first, with_lowest_bit(between, is_reversed), second]
        }
        _ => {
            let scale = ratio / (1.0 + SURFACE_ROUNDING * U / openness(e1, e2));
            let [first, _, second] = edges.map(|squared| round_down(squared * scale));
            [first, near(e1.dot(e2) * scale, is_reversed), second]
        }
    }
}

/// The largest number not above `x` with this lowest bit; 0 for 0. `x` is not negative.
pub(crate) fn with_lowest_bit(x: f32, bit: bool) -> f32 {
    if x == 0.0 || has_lowest_bit(x) == bit { x } else { x.next_down() }
}

/// The nearest f32 to `x` with this lowest bit, within 2^-23 of it.
fn near(x: f64, bit: bool) -> f32 {
    let near = x as f32;
    if has_lowest_bit(near) == bit {
        near
    } else if f64::from(near) < x {
        near.next_up()
    } else {
        near.next_down()
    }
}

fn has_lowest_bit(x: f32) -> bool {
    x.to_bits() & 1 == 1
}

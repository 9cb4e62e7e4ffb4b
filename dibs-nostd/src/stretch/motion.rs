//! The motion of vertices since the published frame.

// Requirement: F-03

#[cfg(feature = "bus")]
use glam::Vec3;

use super::StretchError;
use crate::math::sqrt::sqrt;
use crate::surface::{Millis, VertexTable};

/// Upper bound (mm) on a vertex's motion in this time, at this speed and at most `recovery`; infinite without either.
pub(crate) const fn farthest(speed: f32, recovery: f32, elapsed: Millis) -> f32 {
    // Plus one millisecond, because the clock counts whole ones.
    let distance = speed * (elapsed.0 as f32 + 1.0);
    // A speed or distance that is NaN or negative refuses every frame; the square of a negative one would be a limit.
    let most = if distance <= recovery || distance.is_nan() { distance } else { recovery };
    if most < 0.0 { f32::NAN } else { most }
}

/// The largest squared distance of these rows from their previous positions, or `largest` if larger. NaN if a position
/// is NaN or missing.
#[inline(never)]
pub(crate) fn largest_step<V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
    now: &V,
    before: &W,
    rows: impl Iterator<Item = u32>,
    mut largest: f32,
) -> f32 {
    for row in rows {
        let (Some(now), Some(before)) = (now.position(row), before.position(row)) else {
            return f32::NAN;
        };
        let squared = (now - before).length_squared();
        // Written so that NaN is kept.
        if !(squared <= largest) {
            largest = squared;
        }
    }
    largest
}

/// The largest squares of the last step of these rows, and of its difference from `t` times the previous step; or
/// `largest` and `off` if larger. NaN if a position is NaN.
///
/// The difference is that of two steps, not of two positions, because a step far from the origin is rounded less than a
/// position.
#[cfg(feature = "bus")]
#[inline(never)]
pub(crate) fn largest_change<V: VertexTable + ?Sized>(
    (now, before, earlier): (&V, &V, &V),
    t: f32,
    rows: impl Iterator<Item = u32>,
    (mut largest, mut off): (f32, f32),
) -> (f32, f32) {
    for row in rows {
        let (Some(now), Some(before)) = (now.position(row), before.position(row)) else { break };
        let Some(earlier) = earlier.position(row) else { break };
        let step = now - before;
        let change = step - (before - earlier) * t;
        let [step, change] = [step, change].map(Vec3::length_squared);
        // Written so that NaN is kept.
        if !(step <= largest) {
            largest = step;
        }
        if !(change <= off) {
            off = change;
        }
    }
    (largest, off)
}

/// The error for the first of these rows that moved farther than `limit`.
#[cold]
pub(crate) fn too_fast<V: VertexTable + ?Sized>(
    now: &V,
    before: &V,
    rows: impl Iterator<Item = u32>,
    limit: f32,
) -> StretchError {
    let mut found = StretchError::TooFast { vertex: 0, step: f32::INFINITY, limit };
    for vertex in rows {
        let step = largest_step(now, before, vertex..vertex.saturating_add(1), 0.0);
        if !(step <= limit * limit) {
            found = StretchError::TooFast { vertex, step: sqrt(step), limit };
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Whichever of the two surfaces lacks it. The other rows are compared.
    #[test]
    fn the_step_of_a_missing_row_is_not_a_number() {
        let (whole, short) = ([Vec3::ONE; 3], [Vec3::ZERO; 2]);
        let (whole, short) = (whole.as_slice(), short.as_slice());
        for [now, before] in [[whole, short], [short, whole]] {
            assert_eq!(largest_step(now, before, 0..2, 0.0), 3.0);
            assert!(largest_step(now, before, 0..3, 9.0).is_nan());
        }
    }
}

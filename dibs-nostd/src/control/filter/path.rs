//! The least distance of an axis from a surface during a motion between two poses.

use crate::math::order::smaller;
use crate::math::sqrt::sqrt;

/// Rounding of the sums below, relative to the distances.
const ROUNDING: f32 = 16.0 / 16_777_216.0;

/// A lower bound on the distance of an axis from a surface at rest, less `grow * s`, at any fraction `s` of its path.
///
/// The axis is `start` from the surface at the start and `end` at the end; both are lower bounds, and negative for a
/// signed distance inside. Each of its points moves in a straight line at constant speed, by at most `moved`.
///
/// For a surface point `q` and a point `p` of the axis on its path from `a` to `b`, Stewart's theorem says
///
/// `|q - p(s)|^2 = (1 - s) |q - a|^2 + s |q - b|^2 - s (1 - s) |a - b|^2`,
///
/// so the distance at `s` is at least the root of `(1 - s) start^2 + s end^2 - s (1 - s) moved^2`. Along a wall this
/// loses `moved^2 / (8 start)`, where a bound by the motion alone loses half the motion.
pub(super) fn least(start: f32, end: f32, moved: f32, grow: f32) -> f32 {
    let last = end - grow;
    // Written so that NaN is kept.
    let ends = smaller(last, start);
    let slack = ROUNDING * (start.abs() + end.abs() + moved);
    let by_motion = (start + end - moved) * 0.5 - grow;
    if !(start > 0.0 && end > 0.0) {
        return smaller(ends, by_motion) - slack;
    }
    // The bound falls no faster than the surface approaches.
    if !(moved > grow) {
        return ends - slack;
    }
    // The distance's square is `lowest + (moved (s - s_lowest))^2`.
    let s_lowest = (moved + (start - end) * (start + end) / moved) / (2.0 * moved);
    let along = moved * s_lowest;
    let lowest = start * start - along * along;
    if !(lowest > 0.0) {
        let is_between = s_lowest > 0.0 && s_lowest < 1.0;
        return (if is_between && by_motion < ends { by_motion } else { ends }) - slack;
    }
    let s = s_lowest + grow * sqrt(lowest / (moved * moved - grow * grow)) / moved;
    if !(s > 0.0 && s < 1.0) {
        return ends - slack;
    }
    // Near zero the root magnifies the rounding of the square.
    let rounding = ROUNDING * (start * start + end * end + moved * moved);
    let squared =
        (1.0 - s) * start * start + s * end * end - s * (1.0 - s) * moved * moved - rounding;
    let inside = if squared > 0.0 { sqrt(squared) - grow * s } else { by_motion };
    smaller(ends, inside) - slack
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::least;

    /// Along a wall a straight path loses an amount proportional to the square of its length.
    #[test]
    fn a_path_along_a_wall_loses_little() {
        let loss = 3.0 - least(3.0, 3.0, 0.2, 0.0);
        assert!((loss - 0.04 / 24.0).abs() < 2e-5, "{loss}");
        // Out of the surface, the start is nearest; into it, the end.
        assert!((least(-1.0, 5.0, 0.0, 0.0) + 1.0).abs() < 2e-5);
        assert!((least(1.0, -1.0, 2.0, 0.0) + 1.0).abs() < 2e-5);
        // An approaching surface is nearest at the end.
        assert!((least(3.0, 3.0, 0.2, 0.3) - 2.7).abs() < 2e-5);
        assert!(least(f32::NAN, 3.0, 0.2, 0.0).is_nan() && least(3.0, f32::NAN, 0.2, 0.0).is_nan());
    }

    /// Where two balls barely overlap, the square of the distance in between is so small that rounding may leave nothing
    /// of it, or some more: the root is known to a thousandth of a millimetre, and the bound is below it.
    #[test]
    fn balls_that_barely_overlap_leave_a_narrow_neck() {
        let sizes = || (1..40_u8).map(|sevenths| f32::from(sevenths) / 7.0);
        for (start, end) in sizes().flat_map(|start| sizes().map(move |end| (start, end))) {
            let mut moved = start + end;
            for _ in 0..5 {
                moved = moved.next_down();
                let (a, b, length) = (f64::from(start), f64::from(end), f64::from(moved));
                let beyond = (b - (length - a)) * (b + (length - a)) / (2.0 * length);
                let neck = (beyond * (2.0 * a - beyond)).sqrt();
                let bound = f64::from(least(start, end, moved, 0.0));
                assert!(bound > -1e-3 && bound <= neck, "{start} {end} {moved}: {bound}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

        /// For two balls that contain no surface point, the bound holds on any path between their centres for any point
        /// outside of both.
        #[test]
        fn no_point_outside_of_both_balls_is_nearer(
            start in 0.01_f32..10.0, end in 0.01_f32..10.0, moved in 0.0_f32..12.0, grow in 0.0_f32..2.0,
            samples in prop::collection::vec((0.0_f64..1.0, -12.0_f64..24.0, 0.0_f64..1.0), 20),
        ) {
            let bound = f64::from(least(start, end, moved, grow));
            let (a, b, length) = (f64::from(start), f64::from(end), f64::from(moved));
            for (s, z, more) in samples {
                // A point of the plane at `z` along the path and just outside of both balls, or a little farther.
                let from_a = a * a - z * z;
                let from_b = b * b - (z - length) * (z - length);
                let across = from_a.max(from_b).max(0.0).sqrt() + more * more * more;
                let apart = (z - s * length).hypot(across) - s * f64::from(grow);
                prop_assert!(apart >= bound, "{apart} {bound} at {s}, {z}");
            }
        }
    }
}

//! Lower bounds of the distance between a tool's axis and a box.

use dibs_nostd::{Capsule, Sphere, Tool};
use glam::{Vec3, Vec3A};

/// A tool whose axis' distance from boxes can be bounded.
pub trait Axis: Tool {
    /// The axis in the form for bounds.
    type Prepared: Copy;

    /// Makes that form, once for each query.
    fn prepare(&self) -> Self::Prepared;

    /// A lower bound of the squared distance between the axis and the box. It is exact for a point. For a segment it is
    /// rarely more than two percent below, unless it is above `limit`.
    fn bound(axis: &Self::Prepared, low: Vec3A, high: Vec3A, limit: f32) -> f32;
}

impl Axis for Sphere {
    type Prepared = Vec3A;

    fn prepare(&self) -> Vec3A {
        self.centre().into()
    }

    #[inline(always)]
    fn bound(&center: &Vec3A, low: Vec3A, high: Vec3A, _limit: f32) -> f32 {
        let outside = (low - center).max(center - high).max(Vec3A::ZERO);
        outside.length_squared()
    }
}

/// A segment: its start and its span.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    start: Vec3A,
    span: Vec3A,
    inverse: f32,
}

impl Axis for Capsule {
    type Prepared = Segment;

    fn prepare(&self) -> Segment {
        let (start, end): (Vec3, Vec3) = (self.start(), self.end());
        let span = Vec3A::from(end - start);
        let squared = span.length_squared();
        let inverse = if squared > 0.0 { 1.0 / squared } else { 0.0 };
        Segment { start: start.into(), span, inverse }
    }

    /// The squared distance to the box is a convex, piecewise quadratic function of the place on the segment: Newton's
    /// method finds its minimum in a few steps, and each step's tangent bounds it from below.
    #[inline(always)]
    fn bound(axis: &Segment, low: Vec3A, high: Vec3A, limit: f32) -> f32 {
        let Segment { start, span, inverse } = *axis;
        let middle = (low + high) * 0.5;
        let mut along = ((middle - start).dot(span) * inverse).clamp(0.0, 1.0);
        let mut lower = 0.0_f32;
        for _ in 0..4 {
            let at = start + span * along;
            let outside = at - at.max(low).min(high);
            let squared = outside.length_squared();
            let slope = outside.dot(span);
            let tangent = squared - 2.0 * (slope * along).max(slope * (along - 1.0));
            lower = lower.max(tangent);
            if lower > limit || lower >= 0.98 * squared {
                break;
            }
            let acting = Vec3A::select(outside.cmpeq(Vec3A::ZERO), Vec3A::ZERO, span);
            let curvature = acting.length_squared();
            along = (along - slope / curvature).clamp(0.0, 1.0);
        }
        lower * (1.0 - 1e-5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deform::unit;

    #[test]
    fn a_bound_is_below_the_distance_and_near_it() {
        let mut rng = fastrand::Rng::with_seed(3);
        let mut loose = 0;
        for _ in 0..20_000 {
            let low = unit(&mut rng) * 30.0;
            let high = low + unit(&mut rng).abs() * 20.0 * rng.f32();
            let (start, end) = (unit(&mut rng) * 40.0, unit(&mut rng) * 40.0);
            let distance = |p: Vec3| (p - p.clamp(low, high)).length_squared();
            // A convex function's minimum, by ternary search.
            let (mut a, mut b) = (0.0_f32, 1.0_f32);
            for _ in 0..100 {
                let (x, y) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
                if distance(start.lerp(end, x)) < distance(start.lerp(end, y)) {
                    b = y;
                } else {
                    a = x;
                }
            }
            let least = distance(start.lerp(end, a));
            let capsule = Capsule::new(start, end, 1.0).expect("valid");
            let bound = Capsule::bound(&capsule.prepare(), low.into(), high.into(), f32::INFINITY);
            assert!(bound <= least * (1.0 + 1e-4) + 1e-4, "{bound} > {least}");
            loose += u32::from(bound < 0.97 * least - 1e-2);
            let sphere = Sphere::new(start, 1.0).expect("valid");
            let bound = Sphere::bound(&sphere.prepare(), low.into(), high.into(), f32::INFINITY);
            assert!((bound - distance(start)).abs() <= 1e-4 * bound.max(1.0));
        }
        assert!(loose < 200, "{loose} bounds of 20,000 are loose");
    }
}

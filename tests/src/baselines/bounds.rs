//! Lower bounds on the distance between a tool's axis and a box.

use dibs_nostd::{Capsule, Sphere, Tool};
use glam::{Vec3, Vec3A};

/// A tool whose axis' distance from boxes can be bounded.
pub trait Axis: Tool {
    /// The axis, prepared for computing bounds.
    type Prepared: Copy;

    /// Prepares the axis, once for each query.
    fn prepare(&self) -> Self::Prepared;

    /// A lower bound on the squared distance between the axis and the box. It is exact for a point. For a segment it is
    /// rarely more than two per cent too low, unless it is above `limit`.
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

    /// The squared distance to the box is a convex, piecewise quadratic function of the parameter along the segment:
    /// Newton's method finds its minimum in a few steps, and each step's tangent is a lower bound.
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

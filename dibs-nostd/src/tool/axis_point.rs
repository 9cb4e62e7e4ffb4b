//! A point of another tool's axis.

use glam::Vec3;

use super::{AxisPair, Tool, sealed, triangle};
use crate::math::vec3x4::Vec3x4;

/// A point of another tool's axis: a sphere without radius.
///
/// A separate type gives it a separate instance of the search. If the depth of an axis and the query of a sphere shared
/// one, the compiler would inline it into neither, and spheres would take a tenth more instructions.
#[derive(Clone, Copy)]
pub struct AxisPoint(pub Vec3);

impl sealed::Sealed for AxisPoint {
    #[inline(always)]
    fn axis_to_four(&self, points: &Vec3x4) -> Vec3x4 {
        points.minus(Vec3x4::splat(self.0))
    }

    #[inline(always)]
    fn axis_span(&self) -> Vec3 {
        Vec3::ZERO
    }

    #[inline(always)]
    fn towards(&self, to: &Self, t: f32) -> Self {
        Self(self.0 + (to.0 - self.0) * t)
    }

    #[inline(always)]
    fn with_axis(&self, [point, _]: [Vec3; 2]) -> Self {
        Self(point)
    }
}

impl Tool for AxisPoint {
    #[inline]
    fn radius(&self) -> f32 {
        0.0
    }

    #[inline]
    fn axis_start(&self) -> Vec3 {
        self.0
    }

    #[inline]
    fn axis_length(&self) -> f32 {
        0.0
    }

    #[inline]
    fn axis_point(&self, _parameter: f32) -> Vec3 {
        self.0
    }

    #[inline(always)]
    fn axis_to(&self, point: Vec3) -> Vec3 {
        point - self.0
    }

    #[inline(always)]
    fn axis_distance_squared(&self, point: Vec3) -> f32 {
        self.axis_to(point).length_squared()
    }

    #[inline]
    fn closest_on_triangle(&self, corners: &[Vec3; 3], limit_squared: f32) -> Option<AxisPair> {
        triangle::closest_to_point(self.0, corners, limit_squared)
    }
}

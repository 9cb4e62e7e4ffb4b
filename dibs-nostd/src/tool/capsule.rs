//! The capsule: a segment with a radius.

use super::{AxisPair, Tool, ToolError, check_point, check_radius, clamp_any, sealed, triangle};
use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::math::vec3x4::Vec3x4;
use glam::{Vec3, Vec4};

/// Axes shorter than this are points: the squares of their components underflow.
const SHORTEST: f32 = 1e-15;

/// A capsule-shaped tool: all points within `radius` of a segment. A segment of length zero makes it
/// a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capsule {
    axis: Axis,
    radius: f32,
}

/// A segment, as its start, unit direction and length, so that a projection onto it takes one dot product and no
/// division.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Axis {
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub(super) start: Vec3,
    /// Zero for an axis of length zero.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub(super) direction: Vec3,
    pub(super) length: f32,
}

impl Axis {
    /// The segment from `start` to `end`.
    #[inline(always)]
    fn new(start: Vec3, end: Vec3) -> Self {
        let span = end - start;
        let length = sqrt(span.dot(span));
        if length > SHORTEST {
            // Three divisions rather than one: `length * direction` is then within two roundings of
            // `span`, however `length` was rounded.
            let direction = Vec3::new(span.x / length, span.y / length, span.z / length);
            Self { start, direction, length }
        } else {
            Self::point(start)
        }
    }

    /// A segment of length zero.
    pub(super) fn point(start: Vec3) -> Self {
        Self { start, direction: Vec3::ZERO, length: 0.0 }
    }
}

impl Capsule {
    /// All points within `radius` of the segment from `start` to `end`, in millimetres and the mesh's frame.
    ///
    /// # Errors
    /// A coordinate or radius that is not finite or exceeds [`super::MAX_COORDINATE`], or a negative
    /// radius.
    ///
    /// ```
    /// use dibs_nostd::{Capsule, Tool};
    /// use glam::Vec3;
    /// let shaft = Capsule::new(Vec3::ZERO, Vec3::new(0.0, 0.0, 60.0), 2.5)?;
    /// assert_eq!(shaft.axis_distance_squared(Vec3::new(3.0, 4.0, 30.0)), 25.0);
    /// # Ok::<(), dibs_nostd::ToolError>(())
    /// ```
    pub fn new(start: Vec3, end: Vec3, radius: f32) -> Result<Self, ToolError> {
        check_point(start)?;
        check_point(end)?;
        check_radius(radius)?;
        Ok(Self { axis: Axis::new(start, end), radius })
    }

    /// The segment's first end, as given.
    pub fn start(&self) -> Vec3 {
        self.axis.start
    }

    /// The segment's second end, as given within rounding.
    pub fn end(&self) -> Vec3 {
        self.axis.start + self.axis.length * self.axis.direction
    }
}

impl sealed::Sealed for Capsule {
    #[inline(always)]
    fn axis_to_four(&self, points: &Vec3x4) -> Vec3x4 {
        let Axis { start, direction, length } = self.axis;
        let (direction, length) = (Vec3x4::splat(direction), Vec4::splat(length));
        let offset = points.minus(Vec3x4::splat(start));
        let along = offset.dot(direction);
        let positive = Vec4::select(along.cmpgt(Vec4::ZERO), along, Vec4::ZERO);
        let along = Vec4::select(positive.cmplt(length), positive, length);
        offset.minus(direction.times(along))
    }

    #[inline(always)]
    fn axis_span(&self) -> Vec3 {
        self.axis.length * self.axis.direction
    }

    #[inline(always)]
    fn towards(&self, to: &Self, t: f32) -> Self {
        let between = |from: Vec3, to: Vec3| from + (to - from) * t;
        let (start, end) = (between(self.start(), to.start()), between(self.end(), to.end()));
        Self { axis: Axis::new(start, end), radius: larger(self.radius, to.radius) }
    }

    #[inline(always)]
    fn with_axis(&self, [start, end]: [Vec3; 2]) -> Self {
        Self { axis: Axis::new(start, end), radius: self.radius }
    }
}

impl Tool for Capsule {
    #[inline]
    fn radius(&self) -> f32 {
        self.radius
    }

    #[inline]
    fn axis_start(&self) -> Vec3 {
        self.axis.start
    }

    #[inline]
    fn axis_length(&self) -> f32 {
        // The root of a rounded sum of squares is low by at most 2.5 * 2^-24 of itself.
        self.axis.length * (1.0 + 2.0 * f32::EPSILON)
    }

    #[inline]
    fn axis_point(&self, parameter: f32) -> Vec3 {
        self.axis.start + parameter * self.axis.length * self.axis.direction
    }

    #[inline(always)]
    fn axis_to(&self, point: Vec3) -> Vec3 {
        let Axis { start, direction, length, .. } = self.axis;
        let offset = point - start;
        offset - clamp_any(offset.dot(direction), length) * direction
    }

    #[inline(always)]
    fn axis_distance_squared(&self, point: Vec3) -> f32 {
        self.axis_to(point).length_squared()
    }

    #[inline]
    fn closest_on_triangle(&self, corners: &[Vec3; 3], limit_squared: f32) -> Option<AxisPair> {
        triangle::closest_to_segment(&self.axis, corners, limit_squared)
    }
}

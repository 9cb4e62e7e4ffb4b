//! The sphere: a point with a radius.

use super::{AxisPair, Tool, ToolError, check_point, check_radius, sealed, triangle};
use crate::math::order::larger;
use crate::math::vec3x4::Vec3x4;
use glam::Vec3;

/// A spherical tool, or with radius zero a point.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sphere {
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    centre: Vec3,
    radius: f32,
}

impl Sphere {
    /// A sphere of `radius` around `centre`, in millimetres and the mesh's frame.
    ///
    /// # Errors
    /// A coordinate or radius that is not finite or exceeds [`super::MAX_COORDINATE`], or a negative
    /// radius.
    ///
    /// ```
    /// use dibs_nostd::{Sphere, Tool};
    /// use glam::Vec3;
    /// let tip = Sphere::new(Vec3::new(10.0, 0.0, 0.0), 1.5)?;
    /// assert_eq!(tip.axis_distance_squared(Vec3::ZERO), 100.0);
    /// # Ok::<(), dibs_nostd::ToolError>(())
    /// ```
    pub fn new(centre: Vec3, radius: f32) -> Result<Self, ToolError> {
        check_point(centre)?;
        check_radius(radius)?;
        Ok(Self { centre, radius })
    }

    /// The centre as given.
    pub fn centre(&self) -> Vec3 {
        self.centre
    }
}

impl sealed::Sealed for Sphere {
    #[inline(always)]
    fn axis_to_four(&self, points: &Vec3x4) -> Vec3x4 {
        points.minus(Vec3x4::splat(self.centre))
    }

    #[inline(always)]
    fn axis_span(&self) -> Vec3 {
        Vec3::ZERO
    }

    #[inline(always)]
    fn towards(&self, to: &Self, t: f32) -> Self {
        let centre = self.centre + (to.centre - self.centre) * t;
        Self { centre, radius: larger(self.radius, to.radius) }
    }

    #[inline(always)]
    fn with_axis(&self, [centre, _]: [Vec3; 2]) -> Self {
        Self { centre, radius: self.radius }
    }
}

impl Tool for Sphere {
    #[inline]
    fn radius(&self) -> f32 {
        self.radius
    }

    #[inline]
    fn axis_start(&self) -> Vec3 {
        self.centre
    }

    #[inline]
    fn axis_length(&self) -> f32 {
        0.0
    }

    #[inline]
    fn axis_point(&self, _parameter: f32) -> Vec3 {
        self.centre
    }

    #[inline(always)]
    fn axis_to(&self, point: Vec3) -> Vec3 {
        point - self.centre
    }

    #[inline(always)]
    fn axis_distance_squared(&self, point: Vec3) -> f32 {
        self.axis_to(point).length_squared()
    }

    #[inline]
    fn closest_on_triangle(&self, corners: &[Vec3; 3], limit_squared: f32) -> Option<AxisPair> {
        triangle::closest_to_point(self.centre, corners, limit_squared)
    }
}

//! The tools: a rigid instrument is an *axis* (a point or a segment) with a radius around it.
//!
//! Queries measure from the axis, and subtract the radius once, at the end. So a sphere costs as much as a point, and a
//! radius of zero is an ordinary tool.
//!
//! # Accuracy
//! Let `S` be the largest distance from the axis' start to a corner of the triangle, plus the axis'
//! length. The distance that a tool reports to a triangle differs from the true distance by at most
//! [`ACCURACY`]` * S`, whatever the triangle's shape, as long as no coordinate exceeds
//! [`MAX_COORDINATE`]. (Lengths below 1e-15 count as zero: squares of anything smaller underflow.)
//! The `triangle` module derives the figure; `tests/tests/query/kernels.rs` in the repository searches for
//! a counterexample.

// Requirement: A-01

mod axis_point;
mod capsule;
mod edge;
mod sphere;
mod triangle;

pub(crate) use axis_point::AxisPoint;
pub use capsule::Capsule;
pub use sphere::Sphere;
pub(crate) use triangle::SLIVER;

use core::fmt;
use glam::Vec3;

/// Error of a distance between tool axis and triangle, relative to the problem's size `S`: see the
/// module's documentation of accuracy.
pub const ACCURACY: f32 = 16.0 / 16_777_216.0;

/// The largest magnitude of a tool's coordinate or radius, and of a vertex coordinate for which the
/// accuracy holds: fourth powers of distances must stay finite in f32.
pub const MAX_COORDINATE: f32 = 536_870_912.0;

/// A rigid instrument. [`Sphere`] and [`Capsule`] implement it.
///
/// All lengths are in millimetres, all points in the mesh's frame.
pub trait Tool: Copy + sealed::Sealed {
    /// Radius of the tool around its axis: finite, not negative.
    fn radius(&self) -> f32;

    /// Start of the axis: a sphere's centre, a capsule's first end.
    fn axis_start(&self) -> Vec3;

    /// Length of the axis, rounded up: 0 for a sphere.
    fn axis_length(&self) -> f32;

    /// The axis' point at a parameter: 0 is its start, 1 its end.
    fn axis_point(&self, parameter: f32) -> Vec3;

    /// The shortest vector from the axis to a point. Each component is within 8 * 2^-24 * `S`, `S`
    /// being the point's distance from the axis' start plus the axis' length.
    fn axis_to(&self, point: Vec3) -> Vec3;

    /// Square of the distance from the axis to a point. The root is within 8 * 2^-24 * `S` of the
    /// true distance, `S` being the point's distance from the axis' start plus the axis' length.
    fn axis_distance_squared(&self, point: Vec3) -> f32;

    /// The closest pair between the axis and a triangle, or `None` if it is not closer than
    /// `limit_squared`, the square of a distance (`f32::INFINITY` for no limit).
    ///
    /// Both the distance and the comparison with the limit are accurate to [`ACCURACY`]` * S`.
    /// A triangle with a corner that is not a number, or infinite, is never closer than any limit.
    ///
    /// ```
    /// use dibs_nostd::{AxisPair, Sphere, Tool, glam::Vec3};
    ///
    /// let tool = Sphere::new(Vec3::new(0.0, 0.0, 3.0), 1.0)?;
    /// let triangle = [Vec3::NEG_X, Vec3::X, Vec3::Y];
    /// let AxisPair { distance_squared, .. } =
    ///     tool.closest_on_triangle(&triangle, f32::INFINITY).expect("finite");
    /// assert_eq!(distance_squared, 9.0); // from the axis, not from the tool's surface
    /// assert!(tool.closest_on_triangle(&triangle, 8.0).is_none());
    /// # Ok::<(), dibs_nostd::ToolError>(())
    /// ```
    fn closest_on_triangle(&self, corners: &[Vec3; 3], limit_squared: f32) -> Option<AxisPair>;
}

/// The closest pair between a tool's axis and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct AxisPair {
    /// Square of the distance. Computed from differences to the axis' start; at large coordinates it is more accurate
    /// than the difference of the two points below. Exactly 0 where the axis pierces a triangle that is not a sliver.
    pub distance_squared: f32,
    /// The pair's point on the axis.
    pub on_axis: Vec3,
    /// Parameter of `on_axis`: 0 at the axis' start, 1 at its end; 0 for a sphere.
    pub axis_parameter: f32,
    /// The pair's point on the triangle.
    pub on_surface: Vec3,
    /// Weights of the three corners at `on_surface`: not negative, sum 1 within rounding.
    pub barycentric: [f32; 3],
}

/// Why a tool cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ToolError {
    /// A coordinate is not finite, or its magnitude exceeds [`MAX_COORDINATE`].
    Coordinate {
        /// The coordinate as given.
        value: f32,
    },
    /// The radius is negative, not finite, or exceeds [`MAX_COORDINATE`].
    Radius {
        /// The radius as given.
        value: f32,
    },
}

impl fmt::Display for ToolError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coordinate { value } => {
                write!(f, "tool coordinate {value} is not within ±{MAX_COORDINATE}")
            }
            Self::Radius { value } => {
                write!(f, "tool radius {value} is not within 0 to {MAX_COORDINATE}")
            }
        }
    }
}

impl core::error::Error for ToolError {}

mod sealed {
    use glam::Vec3;

    use crate::math::vec3x4::Vec3x4;

    pub trait Sealed: Sized {
        /// The shortest vectors from the axis to four points, with the same bits as four calls of [`Tool::axis_to`].
        fn axis_to_four(&self, points: &Vec3x4) -> Vec3x4;

        /// From the axis' start to its end, each component within 2^-23 of the axis' length.
        fn axis_span(&self) -> Vec3;

        /// The tool between this one (`t` = 0) and `to` (1), with the larger radius.
        fn towards(&self, to: &Self, t: f32) -> Self;

        /// The same tool with its axis between other ends.
        fn with_axis(&self, ends: [Vec3; 2]) -> Self;
    }
}

fn check_point(point: Vec3) -> Result<(), ToolError> {
    for value in [point.x, point.y, point.z] {
        // Written so that NaN fails.
        let valid = value.abs() <= MAX_COORDINATE;
        if !valid {
            return Err(ToolError::Coordinate { value });
        }
    }
    Ok(())
}

fn check_radius(value: f32) -> Result<(), ToolError> {
    if (0.0..=MAX_COORDINATE).contains(&value) { Ok(()) } else { Err(ToolError::Radius { value }) }
}

/// `x` limited to `0..=high`; NaN stays NaN, so that it is never taken for a distance.
#[inline(always)]
fn clamp(x: f32, high: f32) -> f32 {
    if x < 0.0 {
        0.0
    } else if x > high {
        high
    } else {
        x
    }
}

/// [`clamp`] without a branch, for an unpredictable `x`. NaN becomes an arbitrary number; the caller's `offset` keeps
/// the NaN.
#[inline(always)]
fn clamp_any(x: f32, high: f32) -> f32 {
    if cfg!(target_arch = "arm") {
        // Positive numbers sort as their bits, and integers are cheaper to compare.
        let (bits, most) = (x.to_bits() as i32, high.to_bits() as i32);
        let positive = bits & !(bits >> 31);
        f32::from_bits(if positive < most { positive } else { most } as u32)
    } else {
        let positive = if x > 0.0 { x } else { 0.0 };
        if positive < high { positive } else { high }
    }
}

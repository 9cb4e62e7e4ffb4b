//! The number types in which a side is decided: f32 first, then f64 if rounding hides the side in f32.

// Requirement: A-01

use core::ops::{Add, Div, Mul, Neg, Sub};

use glam::{DVec3, Vec3};

use crate::math::sqrt::sqrt;

/// A number type with its vectors and its rounding.
pub(super) trait Precision:
    Copy
    + PartialOrd
    + From<f32>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type Vector: Copy
        + Sub<Output = Self::Vector>
        + Mul<Self, Output = Self::Vector>
        + Neg<Output = Self::Vector>;

    /// Rounding of a few operations, relative to the size of their terms.
    const ROUNDING: Self;
    /// Square of the sine below which two edges span no plane.
    const FLAT: Self;
    /// More than the rounding of the square of a sine, if no triangle is flat.
    const SINES: Self;
    /// Squares of areas below this lose precision.
    const TINY: Self;
    /// Products of four lengths below this do not overflow.
    const MOST: Self;
    /// Whether a flat triangle makes the side unknown, instead of counting as its edges.
    const IS_ROUGH: bool;
    /// Node tests that take as long as the distance to one triangle.
    const DISTANCE_COST: u32;
    /// The same for one triangle around a vertex.
    const RING_COST: u32;

    fn vector(vector: Vec3) -> Self::Vector;
    fn cross(one: Self::Vector, other: Self::Vector) -> Self::Vector;
    fn dot(one: Self::Vector, other: Self::Vector) -> Self;
    /// The sum of the coordinates' absolute values, at least the length.
    fn size(vector: Self::Vector) -> Self;
    fn absolute(self) -> Self;
    fn is_not_a_number(self) -> bool;
    /// The square root, within 1e-6 of its size.
    fn root(self) -> Self;
}

/// The operations that both types name alike.
macro_rules! operations {
    () => {
        fn cross(one: Self::Vector, other: Self::Vector) -> Self::Vector {
            one.cross(other)
        }

        fn dot(one: Self::Vector, other: Self::Vector) -> Self {
            one.dot(other)
        }

        fn size(vector: Self::Vector) -> Self {
            vector.abs().element_sum()
        }

        fn absolute(self) -> Self {
            self.abs()
        }

        fn is_not_a_number(self) -> bool {
            self.is_nan()
        }
    };
}

impl Precision for f32 {
    type Vector = Vec3;
    const ROUNDING: Self = 5e-7;
    const FLAT: Self = 1e-4;
    const SINES: Self = 1.0 + 1e-3;
    const TINY: Self = 1e-30;
    const MOST: Self = 1e9;
    const IS_ROUGH: bool = true;
    const DISTANCE_COST: u32 = 4;
    const RING_COST: u32 = 3;

    fn vector(vector: Vec3) -> Vec3 {
        vector
    }

    operations!();

    fn root(self) -> Self {
        sqrt(self)
    }
}

/// Most controllers have f64 in software only, where an operation takes 40 to 80 instructions.
impl Precision for f64 {
    type Vector = DVec3;
    const ROUNDING: Self = 1e-15;
    const FLAT: Self = 1e-12;
    const SINES: Self = 1.0 + 1e-8;
    const TINY: Self = 0.0;
    const MOST: Self = 1e75;
    const IS_ROUGH: bool = false;
    const DISTANCE_COST: u32 = 136;
    const RING_COST: u32 = 68;

    fn vector(vector: Vec3) -> DVec3 {
        vector.as_dvec3()
    }

    operations!();

    fn root(self) -> Self {
        Self::from(sqrt(self as f32))
    }
}

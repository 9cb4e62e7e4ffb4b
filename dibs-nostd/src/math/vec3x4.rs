//! Four points at once, by coordinate: one vector instruction each on a large processor.

use glam::{Mat4, Vec3, Vec4};

#[cfg(feature = "batched")]
use crate::math::sqrt::sqrt;

/// Four points or vectors. Each operation rounds like that of [`Vec3`].
#[derive(Clone, Copy, Debug)]
pub struct Vec3x4 {
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
}

impl Vec3x4 {
    /// The positions in four rows of a table; `None` if one is outside.
    #[inline(always)]
    pub fn of(table: impl Fn(u32) -> Option<Vec3>, [a, b, c, d]: [u32; 4]) -> Option<Self> {
        let (a, b) = (table(a)?, table(b)?);
        let (c, d) = (table(c)?, table(d)?);
        // A transpose takes fewer loads than gathering each coordinate.
        let columns = [a, b, c, d].map(|position| position.extend(0.0));
        let [a, b, c, d] = columns;
        let rows = Mat4::from_cols(a, b, c, d).transpose();
        Some(Self { x: rows.x_axis, y: rows.y_axis, z: rows.z_axis })
    }

    /// One point four times.
    #[inline(always)]
    pub fn splat(point: Vec3) -> Self {
        Self { x: Vec4::splat(point.x), y: Vec4::splat(point.y), z: Vec4::splat(point.z) }
    }

    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    pub fn times(self, factors: Vec4) -> Self {
        Self { x: self.x * factors, y: self.y * factors, z: self.z * factors }
    }

    #[inline(always)]
    pub fn dot(self, other: Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
}

/// Four square roots, correctly rounded.
#[cfg(feature = "batched")]
#[inline(always)]
pub fn roots(squares: Vec4) -> Vec4 {
    Vec4::from_array(squares.to_array().map(sqrt))
}

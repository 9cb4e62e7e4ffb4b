//! Positions as three 16-bit numbers in a box.

// Requirement: B-09

use core::fmt;

use glam::Vec3;

use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;

/// The box of 16-bit positions: `position = origin + step * row` on each axis.
///
/// It is part of every frame's begin packet and takes 24 bytes: so the sender can fit it to each frame, and sender and
/// receiver always use the same box.
///
/// Each axis of a decoded position differs from the original by at most `step / 2` plus f32 rounding of 2^-22 of the
/// largest coordinate: see [`error`](Self::error).
///
/// ```
/// use dibs_nostd::{wire::QuantisedBox, glam::Vec3};
/// // A heart of 130 mm in steps of 2 um: no vertex moves by more than 2 um.
/// let grid = QuantisedBox::covering(&[Vec3::splat(-65.0), Vec3::splat(65.0)][..]).unwrap();
/// let exact = Vec3::new(12.345_678, -3.0, 60.0);
/// let decoded = grid.position(grid.quantise(exact).unwrap());
/// assert!((decoded - exact).length() <= grid.error());
/// assert!(grid.error() < 0.002);
/// assert_eq!(grid.quantise(Vec3::splat(65.1)), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantisedBox {
    origin: Vec3,
    step: Vec3,
}

impl QuantisedBox {
    /// The box with its lowest corner at `origin` and 65,535 steps of size `step` along each axis, in
    /// mm.
    ///
    /// # Errors
    /// [`BoxError`] if a step is not positive or a corner is not finite.
    pub fn new(origin: Vec3, step: Vec3) -> Result<Self, BoxError> {
        let candidate = Self { origin, step };
        let positive = step.x > 0.0 && step.y > 0.0 && step.z > 0.0;
        if positive && origin.is_finite() && candidate.upper_corner().is_finite() {
            Ok(candidate)
        } else {
            Err(BoxError { origin, step })
        }
    }

    /// The smallest cube-stepped box over all positions, with one step to spare on each side; `None` without positions,
    /// or for coordinates that are not finite or overflow.
    #[must_use]
    pub fn covering(positions: &[Vec3]) -> Option<Self> {
        let (&first, rest) = positions.split_first()?;
        if !positions.iter().all(|position| position.is_finite()) {
            return None;
        }
        let (mut low, mut high) = (first.to_array(), first.to_array());
        for position in rest {
            low = zip(low, position.to_array(), smaller);
            high = zip(high, position.to_array(), larger);
        }
        // The smallest step must still change the largest coordinate, or the box has no inside.
        let mut step = f32::MIN_POSITIVE;
        for (low, high) in low.into_iter().zip(high) {
            for candidate in
                [(high - low) / 65_533.0, low.abs() * f32::EPSILON, high.abs() * f32::EPSILON]
            {
                if candidate > step {
                    step = candidate;
                }
            }
        }
        Self::new(Vec3::from(low) - Vec3::splat(step), Vec3::splat(step)).ok()
    }

    /// The lowest corner, in mm.
    #[must_use]
    pub const fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Size of one step along each axis, in mm.
    #[must_use]
    pub const fn step(&self) -> Vec3 {
        self.step
    }

    /// The corner opposite to the origin, in mm.
    #[must_use]
    pub fn upper_corner(&self) -> Vec3 {
        self.position([u16::MAX; 3])
    }

    /// The position of a row, in mm. Finite and inside the box for every row.
    #[must_use]
    #[inline(always)]
    pub fn position(&self, [x, y, z]: [u16; 3]) -> Vec3 {
        self.origin + self.step * Vec3::new(f32::from(x), f32::from(y), f32::from(z))
    }

    /// The row nearest to a position, `None` outside the box (by more than half a step).
    ///
    /// Computed in f64, so that the error is at most half a step: meant for senders.
    #[must_use]
    pub fn quantise(&self, position: Vec3) -> Option<[u16; 3]> {
        let axis = |position: f32, origin: f32, step: f32| {
            let row = (f64::from(position) - f64::from(origin)) / f64::from(step) + 0.5;
            (0.0..65_536.0).contains(&row).then_some(row as u16)
        };
        Some([
            axis(position.x, self.origin.x, self.step.x)?,
            axis(position.y, self.origin.y, self.step.y)?,
            axis(position.z, self.origin.z, self.step.z)?,
        ])
    }

    /// Largest distance of a decoded position from the original, in mm.
    ///
    /// Half a step along each axis, plus the f32 rounding of product and sum: at most 2^-24 of the
    /// product, whose size is at most `|position| + |origin|`, and 2^-24 of the position; together
    /// below 2^-22 of the largest coordinate of the box.
    #[must_use]
    pub fn error(&self) -> f32 {
        let rounding = |origin: f32, upper: f32| {
            let (origin, upper) = (origin.abs(), upper.abs());
            larger(upper, origin) * (f32::EPSILON * 2.0)
        };
        let upper = self.upper_corner().to_array();
        let axes = zip(self.origin.to_array(), upper, rounding);
        let axes = Vec3::from(axes) + self.step * 0.5;
        // The squares of steps below 1e-19 mm lose digits, below 1e-22 all of them; so do those of a box near the
        // limits of f32. Then the sum of the axes is used, which is at least the root of their squares.
        let squared = axes.length_squared();
        let length = if (1e-34..=f32::MAX).contains(&squared) {
            sqrt(squared)
        } else {
            axes.x + axes.y + axes.z
        };
        length * (1.0 + 4.0 * f32::EPSILON)
    }
}

/// Applies a function to each axis.
fn zip([ax, ay, az]: [f32; 3], [bx, by, bz]: [f32; 3], f: impl Fn(f32, f32) -> f32) -> [f32; 3] {
    [f(ax, bx), f(ay, by), f(az, bz)]
}

/// A quantisation box that is not finite, or whose step is not positive.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BoxError {
    /// The origin given, in mm.
    pub origin: Vec3,
    /// The step given, in mm.
    pub step: Vec3,
}

#[cfg(feature = "defmt")]
impl defmt::Format for BoxError {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "BoxError {{ origin: {}, step: {} }}",
            self.origin.to_array(),
            self.step.to_array()
        );
    }
}

impl fmt::Display for BoxError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a box from {} in steps of {} is not finite or has no size",
            self.origin, self.step
        )
    }
}

impl core::error::Error for BoxError {}

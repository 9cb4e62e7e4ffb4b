//! The last tick's certain separation.
//!
//! The signed distance of an axis changes by no more than tool and surface move. So the last interval, widened by the
//! motion since, holds whatever has become of a search or of the side.

use glam::Vec3;

use super::clock::{MotionClock, Reading};
use crate::TriangleRow;
use crate::query::Side;

/// What was certain of the axis' signed distance (mm) from the table's positions.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Certain {
    pub lower: f32,
    pub upper: f32,
    /// The pair of the upper end.
    pub side: Side,
    pub axis_parameter: f32,
    pub triangle: Option<TriangleRow>,
    pub direction: Vec3,
}

/// The last one, and when it was certain.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct KnownSeparation {
    last: Option<(Certain, Reading)>,
}

impl KnownSeparation {
    pub const NONE: Self = Self { last: None };

    pub fn forget(&mut self) {
        self.last = None;
    }

    pub fn keep(&mut self, certain: Certain, clock: MotionClock) {
        self.last = Some((certain, clock.now()));
    }

    /// What is certain now.
    pub fn now(&self, clock: MotionClock) -> Option<Certain> {
        let (certain, at) = self.last?;
        let moved = clock.length(clock.since(at)) * (1.0 + 4.0 * f32::EPSILON);
        // Rounded outwards.
        let (lower, upper) = (certain.lower - moved, certain.upper + moved);
        let (lower, upper) =
            (lower - lower.abs() * f32::EPSILON, upper + upper.abs() * f32::EPSILON);
        Some(Certain { lower, upper, ..certain })
    }
}

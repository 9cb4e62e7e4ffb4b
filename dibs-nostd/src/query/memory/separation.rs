//! The last tick's certain separation.
//!
//! The signed distance of an axis changes by no more than tool and surface move. So the last interval, widened by the
//! motion since, holds whatever the current search or side gives.

// Requirement: T-02

use glam::Vec3;

use super::clock::{MotionClock, Reading};
use crate::TriangleRow;
use crate::query::Side;

/// A certain interval of the axis' signed distance (mm) to the table's positions.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct CertainInterval {
    pub lower: f32,
    pub upper: f32,
    /// The pair that gave the upper end.
    pub side: Side,
    pub axis_parameter: f32,
    pub triangle: Option<TriangleRow>,
    pub direction: Vec3,
}

/// The last certain interval, and its reading.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct KnownSeparation {
    last: Option<(CertainInterval, Reading)>,
}

impl KnownSeparation {
    pub const NONE: Self = Self { last: None };

    pub fn forget(&mut self) {
        self.last = None;
    }

    pub fn keep(&mut self, certain: CertainInterval, clock: MotionClock) {
        self.last = Some((certain, clock.now()));
    }

    /// The interval at its reading.
    #[inline(always)]
    pub fn last(&self) -> Option<&CertainInterval> {
        self.last.as_ref().map(|(certain, _)| certain)
    }

    /// The interval now, widened by the motion since.
    pub fn now(&self, clock: MotionClock) -> Option<CertainInterval> {
        let (certain, at) = self.last?;
        let moved = clock.moved_since(at)?;
        // Rounded outwards.
        let (lower, upper) = (certain.lower - moved, certain.upper + moved);
        let (lower, upper) =
            (lower - lower.abs() * f32::EPSILON, upper + upper.abs() * f32::EPSILON);
        Some(CertainInterval { lower, upper, ..certain })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tree;
    use crate::surface::motion::Unit;

    #[test]
    fn nothing_is_certain_after_more_motion_than_the_clock_tells_apart() {
        let mesh = dibs_build::generate::heart(320).unwrap().mesh;
        let built = dibs_build::Builder::new().build(&mesh).unwrap();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let mut clock = MotionClock::new(Unit::of(&tree));
        let mut known = KnownSeparation::NONE;
        let certain = CertainInterval {
            lower: 1.0,
            upper: 2.0,
            side: Side::Outside,
            axis_parameter: 0.0,
            triangle: None,
            direction: Vec3::X,
        };
        known.keep(certain, clock);
        let mut widest = 0.0;
        for _ in 0..3 {
            clock.advance(1 << 29);
            let now = known.now(clock).expect("less than half a turn");
            assert!(now.upper - now.lower > widest);
            widest = now.upper - now.lower;
        }
        clock.advance(1 << 29);
        assert!(known.now(clock).is_none());
    }
}

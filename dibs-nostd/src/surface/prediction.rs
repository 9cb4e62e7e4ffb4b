//! The step of an extrapolated surface at a new frame: bounded by the extrapolation's error instead of the distance
//! between the frames.
//!
//! For the frames `a`, `b` and `c`, let `c = b + r (b - a) + e`: `r` is the time of `c` on the prediction of `a` and
//! `b`, and `e` is its residual. Before `c`, the surface was `b + s (b - a)`; after it, it is `c + t (c - b)`. The
//! difference is `((1 + t) r - s) (b - a) + (1 + t) e`: the elapsed time on the old prediction, and an error that grows
//! with the new one.

// Requirements: F-05, T-04

use super::buffer::PredictionCheck;

/// The progress of an extrapolated surface along the previous frame's prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Prediction {
    /// Odometer units from the previous frame to the surface's frame; 0 if there is no prediction.
    units: u32,
    /// Units from the previous frame along the earlier prediction: `(1 + t) r` times the length of `b - a`.
    passed: u32,
    /// Upper bound on the units from there to the surface.
    off: u32,
}

impl Prediction {
    /// No extrapolation.
    pub const NONE: Self = Self { units: 0, passed: 0, off: 0 };

    /// The prediction of a surface extrapolated by `t` of the step, `units` long, to a frame whose label has `ahead`.
    pub fn new(units: u64, ahead: &PredictionCheck, t: f32) -> Self {
        if ahead.off == PredictionCheck::UNKNOWN.off {
            return Self::NONE;
        }
        // `1 + t` times as much. No sum overflows: `t` is at most 2.
        let grown = |units: u32| u64::from(units) + (t * units as f32) as u64;
        let (passed, off) = (grown(ahead.passed), grown(ahead.off));
        // `t` and products are rounded by a few times 2^-24.
        let off = off + (passed + off) / (1 << 20) + 2;
        // If a number is too large to store, nothing is known: a smaller one would understate the motion.
        match (units.try_into(), passed.try_into(), off.try_into()) {
            (Ok(units), Ok(passed), Ok(off)) => Self { units, passed, off },
            _ => Self::NONE,
        }
    }

    /// Upper bound on a vertex's distance from its position `residual` units beyond the previous frame, on that frame's
    /// prediction; `None` if the previous frame is not `along` units away.
    #[inline(always)]
    pub fn since(&self, along: u64, residual: u32) -> Option<u64> {
        let is_next = along == u64::from(self.units);
        is_next.then(|| u64::from(self.passed.abs_diff(residual)) + u64::from(self.off))
    }
}

#[cfg(all(test, feature = "bus"))]
mod tests;

//! The step of an extrapolated surface at a new frame: the extrapolation's error, not the distance between the frames.
//!
//! Of the frames `a`, `b` and `c`, let `c = b + r (b - a) + e`: `r` is the time at which `c` was expected on the
//! prediction of `a` and `b`, and `e` its distance from there. Before `c`, the surface was `b + s (b - a)`; after it,
//! it is `c + t (c - b)`. The difference is `((1 + t) r - s) (b - a) + (1 + t) e`: the time that went by on the old
//! prediction, and an error that grows with the new one.

// Requirements: F-05, T-04

use super::buffer::PredictionCheck;

/// The prediction of the frames one earlier, as far as an extrapolated surface is along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Prediction {
    /// Units of the odometer from the frame before to the surface's; 0 if there is no prediction.
    units: u32,
    /// Units from the frame before on the earlier prediction: `(1 + t) r` times the length of `b - a`.
    passed: u32,
    /// Units from there to the surface, at most.
    off: u32,
}

impl Prediction {
    /// Of a surface that is not extrapolated.
    pub const NONE: Self = Self { units: 0, passed: 0, off: 0 };

    /// The prediction of a surface extrapolated by `t` of the step, `units` long, to a frame whose label has `ahead`.
    pub fn new(units: u64, ahead: &PredictionCheck, t: f32) -> Self {
        if ahead.off == PredictionCheck::UNKNOWN.off {
            return Self::NONE;
        }
        // `1 + t` times as much. No sum overflows: `t` is at most 2.
        let grown = |units: u32| u64::from(units) + (t * units as f32) as u64;
        let (passed, off) = (grown(ahead.passed), grown(ahead.off));
        // `t` and products are rounded by a few parts in 2^24.
        let off = off + (passed + off) / (1 << 20) + 2;
        // Where a number is too large to be kept, nothing is known: a smaller one would understate the motion.
        match (units.try_into(), passed.try_into(), off.try_into()) {
            (Ok(units), Ok(passed), Ok(off)) => Self { units, passed, off },
            _ => Self::NONE,
        }
    }

    /// The farthest that a vertex can be from its position `aside` units beyond the frame before, on the prediction of
    /// that; `None` if the frame before is not `along` units away.
    #[inline(always)]
    pub fn since(&self, along: u64, aside: u32) -> Option<u64> {
        let is_next = along == u64::from(self.units);
        is_next.then(|| u64::from(self.passed.abs_diff(aside)) + u64::from(self.off))
    }
}

#[cfg(all(test, feature = "bus"))]
mod tests;

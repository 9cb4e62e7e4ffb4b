//! The answer of a tick.

// Requirement: T-01

use crate::query::Proximity;
use crate::query::memory::Loss;

/// The answer of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct TrackerAnswer {
    /// The closest pair; its test counts are this tick's.
    pub closest: Proximity,
    /// The side is the last tick's, as the motion since allows it, because this tick's search found none: its budget
    /// ended, or the side is undefined. The pair may then not be the closest one; the certified interval holds.
    pub is_kept: bool,
    /// The reason, if this tick was a whole query.
    pub fallback: Option<Fallback>,
    /// Upper bound (mm) on the motion of tool and surface together since the last tick; `None` if unknown, and for
    /// several pairs.
    pub moved: Option<f32>,
    /// Slots of `OPENED` used since the front last started.
    pub opened: u32,
    /// The closest pair's index in [`Tracker::closest_of`](crate::Tracker::closest_of); else 0.
    pub pair: usize,
    /// Number of pairs searched; the others were certainly farther.
    pub searched: u32,
}

/// Why a tick was a whole query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Fallback {
    /// Nothing is remembered: this is the first tick, or the one after an error or a full front.
    Start,
    /// The surface's motion was not measured over the whole time since the last tick.
    Surface,
    /// Tool or surface moved so far that more than half of the front's bounds ran out.
    Jump,
    /// More nodes had to be opened than there are slots. The next tick restarts. If this occurs often, a tracker
    /// costs more than a query: it has too few slots for this surface and these poses. `dibs track` counts the slots
    /// needed.
    Full,
}

impl From<Loss> for Fallback {
    fn from(loss: Loss) -> Self {
        match loss {
            Loss::Start => Self::Start,
            Loss::Surface => Self::Surface,
            Loss::Jump => Self::Jump,
        }
    }
}

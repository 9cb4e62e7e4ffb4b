//! The machine's limits.

use core::fmt;

use super::State;
use super::freshness::Freshness;
use crate::surface::Millis;

/// Two limits on one input, a time or a count: beyond the first the state is degraded, beyond the second safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ThresholdPair<T = Millis> {
    degraded: T,
    safe: T,
}

/// A time of half the clock's range or more is ambiguous.
const LONGEST: u32 = i32::MAX as u32;

/// The type of a quantity limited by a [`ThresholdPair`].
#[doc(hidden)]
pub trait Quantity: Copy + PartialOrd + sealed::Sealed {
    /// Its largest value.
    const MOST: Self;
}

impl Quantity for Millis {
    const MOST: Self = Self::MAX;
}

impl Quantity for u32 {
    const MOST: Self = Self::MAX;
}

mod sealed {
    use crate::surface::Millis;

    pub trait Sealed {}
    impl Sealed for Millis {}
    impl Sealed for u32 {}
}

impl<T: Quantity> ThresholdPair<T> {
    /// An input that is not watched.
    pub const OFF: Self = Self { degraded: T::MOST, safe: T::MOST };

    /// The first limit.
    #[must_use]
    pub const fn degraded(&self) -> T {
        self.degraded
    }

    /// The second limit.
    #[must_use]
    pub const fn safe(&self) -> T {
        self.safe
    }

    pub(super) fn level(&self, value: T) -> State {
        if value > self.safe {
            State::Safe
        } else if value > self.degraded {
            State::Degraded
        } else {
            State::Nominal
        }
    }
}

impl ThresholdPair {
    /// Limits on a time: a time above `degraded` leads to the degraded state, above `safe` to the safe state.
    ///
    /// # Errors
    /// [`LimitError`] if `safe` is below `degraded`, or not below 2^31 ms.
    pub const fn new(degraded: Millis, safe: Millis) -> Result<Self, LimitError> {
        match check(degraded.0, safe.0) {
            Ok(()) => Ok(Self { degraded, safe }),
            Err(error) => Err(error),
        }
    }
}

impl ThresholdPair<u32> {
    /// Limits on a count of frames or packets, in the same way.
    ///
    /// # Errors
    /// [`LimitError`] if `safe` is below `degraded`, or not below 2^31.
    pub const fn count(degraded: u32, safe: u32) -> Result<Self, LimitError> {
        match check(degraded, safe) {
            Ok(()) => Ok(Self { degraded, safe }),
            Err(error) => Err(error),
        }
    }
}

const fn check(degraded: u32, safe: u32) -> Result<(), LimitError> {
    if degraded > safe {
        Err(LimitError::Order { degraded, safe })
    } else if safe >= LONGEST {
        Err(LimitError::TooLong { safe })
    } else {
        Ok(())
    }
}

/// The machine's limits, and its conditions for recovery.
///
/// Only limits on the age are required. The transit of frames has the same limits, unless others are given or it is
/// [left out](Self::without_transit); every other input is off by default. By default one good frame, 1,000 clear steps
/// and an acknowledgement are needed to recover.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Limits {
    pub(super) age: ThresholdPair,
    pub(super) silence: ThresholdPair,
    pub(super) heartbeat: ThresholdPair,
    pub(super) rejections: ThresholdPair<u32>,
    pub(super) freshness: Freshness,
    tissue_speed: f32,
    recovery_frames: u16,
    dwell: u32,
    automatic: bool,
}

/// The default number of steps that a state lasts before it improves: a second of a loop at 1 kHz.
const DWELL: u32 = 1_000;

impl Limits {
    /// Limits on the surface's age, and the largest speed of any of its points, in mm per millisecond (m/s). 0 adds no
    /// margin for age and transit.
    ///
    /// # Errors
    /// [`LimitError`] if the age is not watched, or the speed is negative or not finite.
    pub const fn new(age: ThresholdPair, tissue_speed: f32) -> Result<Self, LimitError> {
        if age.safe.0 == u32::MAX {
            return Err(LimitError::TooLong { safe: age.safe.0 });
        }
        if !(tissue_speed >= 0.0 && tissue_speed.is_finite()) {
            return Err(LimitError::Speed { tissue_speed });
        }
        Ok(Self {
            age,
            silence: ThresholdPair::OFF,
            heartbeat: ThresholdPair::OFF,
            rejections: ThresholdPair::OFF,
            freshness: Freshness::OFF,
            tissue_speed,
            recovery_frames: 1,
            dwell: DWELL,
            automatic: false,
        })
    }

    /// Limits on the time since the last good packet.
    #[must_use]
    pub const fn silence(self, pair: ThresholdPair) -> Self {
        Self { silence: pair, ..self }
    }

    /// Limits on the time since the last heartbeat.
    #[must_use]
    pub const fn heartbeat(self, pair: ThresholdPair) -> Self {
        Self { heartbeat: pair, ..self }
    }

    /// Limits on the frames refused or abandoned since the last publication, each counted once.
    #[must_use]
    pub const fn rejections(self, pair: ThresholdPair<u32>) -> Self {
        Self { rejections: pair, ..self }
    }

    /// Frames that must be published in a row, with every input within its first limit, to recover.
    ///
    /// # Errors
    /// [`LimitError`] for 0, with which a fault would end without a new surface.
    pub const fn recovery(self, frames: u16) -> Result<Self, LimitError> {
        if frames == 0 {
            return Err(LimitError::Recovery { frames });
        }
        Ok(Self { recovery_frames: frames, ..self })
    }

    /// Steps in a row with every input within its first limit, before the one that recovers: 1,000 by default. It
    /// bounds how often an attacker who can exceed a limit at will makes the state change. The state gets worse at
    /// once.
    #[must_use]
    pub const fn dwell(self, steps: u32) -> Self {
        Self { dwell: steps, ..self }
    }

    /// Leaves the safe state without an acknowledgement.
    #[must_use]
    pub const fn automatic(self) -> Self {
        Self { automatic: true, ..self }
    }

    /// Whether the safe state is left without an acknowledgement.
    #[must_use]
    pub const fn is_automatic(&self) -> bool {
        self.automatic
    }

    /// Frames in a row needed to recover.
    #[must_use]
    pub const fn recovery_frames(&self) -> u16 {
        self.recovery_frames
    }

    /// Clear steps in a row needed before the one that recovers.
    #[must_use]
    pub const fn dwell_steps(&self) -> u32 {
        self.dwell
    }

    /// The limits on age.
    #[must_use]
    pub const fn age(&self) -> ThresholdPair {
        self.age
    }

    /// Upper bound on the tissue's motion within a time, in mm, rounded up.
    #[must_use]
    pub fn margin(&self, time: Millis) -> f32 {
        // Conversion and product each round by at most half an epsilon.
        time.0 as f32 * self.tissue_speed * (1.0 + 2.0 * f32::EPSILON)
    }
}

/// A fail-safe limit is out of range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LimitError {
    /// The safe limit is below the degraded one.
    Order {
        /// The first limit.
        degraded: u32,
        /// The second limit.
        safe: u32,
    },
    /// A limit of 2^31 or more, which a wrapped clock could hide.
    TooLong {
        /// The second limit.
        safe: u32,
    },
    /// A limit that the input never exceeds.
    Untrippable {
        /// The second limit.
        safe: u32,
    },
    /// A tissue speed that is negative or not finite.
    Speed {
        /// The speed.
        tissue_speed: f32,
    },
    /// A control loop with 0 ticks per second.
    Rate,
    /// The tree has no rest shape from which a limit on the reach could follow.
    NoReach,
    /// Recovery with 0 new frames.
    Recovery {
        /// The requested frames.
        frames: u16,
    },
}

impl fmt::Display for LimitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Order { degraded, safe } => {
                write!(f, "the safe limit {safe} is below the degraded limit {degraded}")
            }
            Self::TooLong { safe } => write!(f, "a limit of {safe} is not below 2^31"),
            Self::Untrippable { safe } => {
                write!(f, "a limit of {safe} can never be exceeded")
            }
            Self::Speed { tissue_speed } => write!(f, "tissue cannot move at {tissue_speed} mm/ms"),
            Self::Rate => write!(f, "a control loop cannot have 0 ticks a second"),
            Self::NoReach => {
                write!(f, "the tree has no rest shape: give the surface's limits, with their reach")
            }
            Self::Recovery { frames } => write!(f, "{frames} frames cannot recover a surface"),
        }
    }
}

impl core::error::Error for LimitError {}

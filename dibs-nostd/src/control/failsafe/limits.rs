//! The machine's limits.

use core::fmt;

use super::State;
use super::freshness::Freshness;

/// Two limits on one input: beyond the first the state is degraded, beyond the second safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Watch {
    degraded: u32,
    safe: u32,
}

/// A time of half the clock's range or more is ambiguous.
const LONGEST: u32 = i32::MAX as u32;

impl Watch {
    /// An input that is not watched.
    pub const OFF: Self = Self { degraded: u32::MAX, safe: u32::MAX };

    /// Values above `degraded` lead to the degraded state, values above `safe` to the safe state. In the clock's unit,
    /// or a number of rejections.
    ///
    /// # Errors
    /// [`LimitError`] when `safe` is below `degraded`, or not below 2^31.
    pub const fn new(degraded: u32, safe: u32) -> Result<Self, LimitError> {
        if degraded > safe {
            Err(LimitError::Order { degraded, safe })
        } else if safe >= LONGEST {
            Err(LimitError::TooLong { safe })
        } else {
            Ok(Self { degraded, safe })
        }
    }

    /// The first limit.
    #[must_use]
    pub const fn degraded(&self) -> u32 {
        self.degraded
    }

    /// The second limit.
    #[must_use]
    pub const fn safe(&self) -> u32 {
        self.safe
    }

    pub(super) const fn level(&self, value: u32) -> State {
        if value > self.safe {
            State::Safe
        } else if value > self.degraded {
            State::Degraded
        } else {
            State::Nominal
        }
    }
}

/// The machine's limits, and its conditions for recovery.
///
/// Only the age must be watched; every other input is off by default. By default one good frame and an acknowledgement
/// recover.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Limits {
    pub(super) age: Watch,
    pub(super) silence: Watch,
    pub(super) heartbeat: Watch,
    pub(super) rejections: Watch,
    pub(super) freshness: Freshness,
    tissue_speed: f32,
    recovery_frames: u16,
    automatic: bool,
}

impl Limits {
    /// Limits on the surface's age, and the largest speed of any of its points, in mm per unit of the clock (for a
    /// clock of milliseconds: in m/s). 0 adds no margin for age.
    ///
    /// # Errors
    /// [`LimitError`] if the age is not watched, or the speed is negative or not finite.
    pub const fn new(age: Watch, tissue_speed: f32) -> Result<Self, LimitError> {
        if age.safe == u32::MAX {
            return Err(LimitError::TooLong { safe: age.safe });
        }
        if !(tissue_speed >= 0.0 && tissue_speed.is_finite()) {
            return Err(LimitError::Speed { tissue_speed });
        }
        Ok(Self {
            age,
            silence: Watch::OFF,
            heartbeat: Watch::OFF,
            rejections: Watch::OFF,
            freshness: Freshness::OFF,
            tissue_speed,
            recovery_frames: 1,
            automatic: false,
        })
    }

    /// Limits on the time since the last good packet.
    #[must_use]
    pub const fn silence(self, watch: Watch) -> Self {
        Self { silence: watch, ..self }
    }

    /// Limits on the time since the last heartbeat.
    #[must_use]
    pub const fn heartbeat(self, watch: Watch) -> Self {
        Self { heartbeat: watch, ..self }
    }

    /// Limits on the frames refused or damaged since the last publication, each counted once.
    #[must_use]
    pub const fn rejections(self, watch: Watch) -> Self {
        Self { rejections: watch, ..self }
    }

    /// Frames that must be published in a row, with every input within its first limit, to recover.
    ///
    /// # Errors
    /// [`LimitError`] for 0, with which a fault would recover without a new surface.
    pub const fn recovery(self, frames: u16) -> Result<Self, LimitError> {
        if frames == 0 {
            return Err(LimitError::Recovery { frames });
        }
        Ok(Self { recovery_frames: frames, ..self })
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

    /// Frames in a row that recover.
    #[must_use]
    pub const fn recovery_frames(&self) -> u16 {
        self.recovery_frames
    }

    /// The limits on age.
    #[must_use]
    pub const fn age(&self) -> Watch {
        self.age
    }

    /// Distance that tissue may move within an age, in mm, rounded up.
    #[must_use]
    pub fn margin(&self, age: u32) -> f32 {
        // Conversion and product each round by at most half an epsilon.
        age as f32 * self.tissue_speed * (1.0 + 2.0 * f32::EPSILON)
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
    /// A tissue speed that is negative or not finite.
    Speed {
        /// The speed.
        tissue_speed: f32,
    },
    /// Recovery with 0 new frames.
    Recovery {
        /// The frames asked for.
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
            Self::Speed { tissue_speed } => write!(f, "tissue cannot move at {tissue_speed}"),
            Self::Recovery { frames } => write!(f, "{frames} frames cannot recover a surface"),
        }
    }
}

impl core::error::Error for LimitError {}

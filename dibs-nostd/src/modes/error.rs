//! Defects of modes, and of weights.

use core::fmt;

/// Why a tree's modes cannot be used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModesError {
    /// The tree was built without modes.
    Absent,
    /// The tree was emitted without its rest shape, which the modes displace.
    NoRestShape,
    /// The section is not as long as its counts require.
    Length {
        /// Bytes that the counts require.
        expected: u64,
        /// Bytes of the section.
        found: u64,
    },
    /// A header field has a value that no builder writes.
    Field {
        /// Offset of the field in the section.
        offset: u8,
        /// Its value.
        value: u32,
    },
    /// A mode's range, gain or growth is not valid, or the sum of all modes is too large.
    Mode {
        /// The mode.
        mode: u32,
    },
    /// An anchor has a weight, stretch or triangle that no builder writes.
    Anchor {
        /// The anchor.
        anchor: u32,
    },
}

impl fmt::Display for ModesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Absent => write!(f, "the tree was built without modes"),
            Self::NoRestShape => write!(f, "the tree has no rest shape for its modes to displace"),
            Self::Length { expected, found } => {
                write!(f, "modes of {expected} bytes expected, {found} bytes found")
            }
            Self::Field { offset, value } => {
                write!(f, "field at {offset} of the modes holds {value:#x}, which is not valid")
            }
            Self::Mode { mode } => write!(f, "the record of mode {mode} is not valid"),
            Self::Anchor { anchor } => write!(f, "anchor {anchor} of the modes is not valid"),
        }
    }
}

impl core::error::Error for ModesError {}

/// Why weights are refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WeightsError {
    /// The number of weights is not the number of modes.
    Count {
        /// Modes of the surface.
        expected: u32,
        /// Weights given.
        found: u32,
    },
    /// A weight is infinite or not a number.
    NotFinite {
        /// The first such mode.
        mode: u32,
    },
    /// A weight is farther from its recorded range than the stored margin allows.
    OutOfRange {
        /// The first such mode.
        mode: u32,
        /// Its weight.
        weight: f32,
    },
    /// The surface has more modes than the buffer holds.
    Capacity {
        /// Modes of the surface.
        needed: u32,
        /// Weights that the buffer holds.
        available: u32,
    },
}

impl fmt::Display for WeightsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Count { expected, found } => {
                write!(f, "{found} weights for a surface of {expected} modes")
            }
            Self::NotFinite { mode } => write!(f, "the weight of mode {mode} is not finite"),
            Self::OutOfRange { mode, weight } => {
                write!(f, "weight {weight} of mode {mode} is out of its range")
            }
            Self::Capacity { needed, available } => {
                write!(f, "the surface has {needed} modes, there is room for {available}")
            }
        }
    }
}

impl core::error::Error for WeightsError {}

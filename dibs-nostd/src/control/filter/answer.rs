//! A filter's answers: the admitted motion and its reason, or an error.

use core::fmt;

use super::RigidMotion;
use crate::unavailable::{QueryError, Unavailable};

/// The motion that a filter admits.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct AdmittedMotion {
    /// The motion to execute.
    pub motion: RigidMotion,
    /// Lower bound (mm) on the separation of every tool during the whole period, for any tissue position within its
    /// uncertainty.
    pub least_separation: f32,
    /// Why this motion was chosen.
    pub reason: Reason,
    /// Number of queries made.
    pub queries: u32,
    /// Instructions of the tick, by the filter's [`Cost`](crate::Cost).
    pub instructions: u32,
}

/// Why a motion was admitted. All but the last are safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Reason {
    /// The motion is the command.
    Commanded,
    /// The motion nearest to the command that walls, the caller's rows and the robot's speed allow.
    Nearest,
    /// Half of that or less: no more could be verified.
    Shortened,
    /// Only rest could be verified.
    Stopped,
    /// The surface approaches: the smallest motion that keeps the stand-off.
    Retreating,
    /// No motion was found that certainly keeps the stand-off. The motion is the best one known: rest, or one that ends
    /// farther from the tissue.
    NoSafeMotion,
}

impl Reason {
    /// The name that `dibs filter` prints.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Commanded => "commanded",
            Self::Nearest => "nearest",
            Self::Shortened => "shortened",
            Self::Stopped => "stopped",
            Self::Retreating => "retreating",
            Self::NoSafeMotion => "no safe motion",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

/// Why a filter admits no motion: the tool must stay at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FilterError {
    /// A parameter is out of its range.
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// Its value.
        value: f32,
    },
    /// The commanded motion is not finite.
    Command,
    /// A number of a caller's row is not finite, or the length of its factors is [out of range](super::MotionRow).
    Row {
        /// The row's index.
        row: usize,
    },
    /// The caller gave more rows than there are slots.
    Rows {
        /// Rows given.
        found: usize,
        /// Slots.
        most: usize,
    },
    /// No pair of tool and surface, or more than there are slots.
    Pairs {
        /// Pairs given.
        found: usize,
        /// Slots.
        most: usize,
    },
    /// A stand-off of a label that no triangle has.
    Unlabelled {
        /// The label.
        label: u8,
    },
    /// A query gave no answer.
    Query(QueryError),
    /// No surface is trusted: a [guard](crate::guard::Guard::admit) is in its safe state.
    Untrusted(Unavailable),
}

impl From<QueryError> for FilterError {
    fn from(error: QueryError) -> Self {
        Self::Query(error)
    }
}

impl fmt::Display for FilterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter { parameter, value } => write!(f, "{parameter} cannot be {value}"),
            Self::Command => write!(f, "the commanded motion is not finite"),
            Self::Row { row } => write!(f, "row {row} is not finite, or out of range"),
            Self::Rows { found, most } => {
                write!(f, "{found} rows, but at most {most} have a slot")
            }
            Self::Pairs { found: 0, .. } => write!(f, "no pair of a tool and a surface"),
            Self::Pairs { found, most } => {
                write!(f, "{found} pairs of tool and surface, but at most {most} have a slot")
            }
            Self::Unlabelled { label } => {
                write!(f, "a stand-off of the label {label}, but no triangle has it")
            }
            Self::Query(error) => error.fmt(f),
            Self::Untrusted(cause) => write!(f, "no surface to trust: {cause}"),
        }
    }
}

impl core::error::Error for FilterError {}

//! Causes of a missing answer, shared by surface, query and fail-safe machine.

// Requirement: A-07

mod query;

use core::fmt;

pub use query::QueryError;

use crate::time::Millis;

/// Why there is no proximity for a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Unavailable {
    /// No surface was ever published, or not for long enough since the start: a [fail-safe machine](crate::failsafe)
    /// begins in its safe state.
    NoSurface,
    /// The surface was good for long enough, and the [fail-safe machine](crate::failsafe) waits for its acknowledgement.
    Unacknowledged,
    /// The surface is older than allowed.
    Stale {
        /// Its age.
        age: Millis,
    },
    /// The query failed.
    Query(QueryError),
    /// The tree's bytes changed since they were validated: [`Scrub`](crate::Scrub).
    CorruptTree,
    /// No good packet was received within the allowed time.
    LinkLost {
        /// Time since the last one.
        silence: Millis,
    },
    /// No heartbeat was received within the allowed time.
    HeartbeatLost {
        /// Time since the last one.
        silence: Millis,
    },
    /// More frames were refused or damaged than allowed since the last publication.
    Rejections {
        /// Their number.
        streak: u32,
    },
    /// The transit of the surface was longer than allowed, or is unknown.
    Delayed {
        /// Time from the status that the frame echoes to its arrival; [`Millis::MAX`] if it echoes none.
        transit: Millis,
    },
    /// The surface was older than allowed when it was sent: its source has stopped.
    SourceStale {
        /// Its age then.
        age: Millis,
    },
    /// More packets were forged than allowed.
    Forgeries {
        /// Packets without a genuine tag.
        count: u32,
    },
    /// The tool has no pose at this tick.
    NoPose,
    /// The tool's axis touches the surface: no direction leads out.
    NoDirection,
    /// The tool's side is not known, so it may be inside; [`Proximity::side`](crate::Proximity::side) has the reason.
    NoSide,
    /// The budget ended before the tool's side or its contacts were known.
    CutShort,
    /// A number is not finite, or the direction is not a unit vector.
    NotFinite,
}

impl fmt::Display for Unavailable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSurface => write!(f, "there is no surface, or not for long enough yet"),
            Self::Unacknowledged => write!(f, "the safe state was not acknowledged"),
            Self::Stale { age } => write!(f, "the surface is {age} old"),
            Self::Query(error) => error.fmt(f),
            Self::CorruptTree => write!(f, "the tree's bytes changed since they were validated"),
            Self::LinkLost { silence } => write!(f, "no good packet came for {silence}"),
            Self::HeartbeatLost { silence } => write!(f, "no heartbeat came for {silence}"),
            Self::Rejections { streak } => {
                write!(f, "{streak} frames were refused or damaged in a row")
            }
            Self::Delayed { transit } => {
                write!(f, "the surface may have been {transit} in transit")
            }
            Self::SourceStale { age } => write!(f, "the surface was {age} old when it was sent"),
            Self::Forgeries { count } => write!(f, "{count} packets were forged"),
            Self::NoPose => write!(f, "the tool has no pose"),
            Self::NoDirection => write!(f, "the tool's axis touches the surface"),
            Self::NoSide => write!(f, "the tool's side is not known"),
            Self::CutShort => {
                write!(f, "the budget ended before the side or the contacts were known")
            }
            Self::NotFinite => write!(f, "a number is not finite"),
        }
    }
}

impl core::error::Error for Unavailable {}

impl From<QueryError> for Unavailable {
    fn from(error: QueryError) -> Self {
        Self::Query(error)
    }
}

//! The outcomes of a packet and of a slice of work.

use dibs_nostd::{Advance, Progress};

/// The outcome of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_progress {
    /// No packet is complete yet.
    None = 0,
    /// A frame began.
    Begun = 1,
    /// The packet was accepted.
    Stored = 2,
    /// The packet was a repetition, and was ignored.
    Duplicate = 3,
    /// The frame is complete: `dibs_receiver_advance` checks and publishes it.
    Complete = 4,
    /// The packet was a heartbeat of the sender.
    Heartbeat = 5,
    /// The packet was a hello, which asks for a status: it is due now.
    Hello = 6,
}

impl From<Progress> for dibs_progress {
    fn from(progress: Progress) -> Self {
        match progress {
            Progress::Begun { .. } => Self::Begun,
            Progress::Duplicate => Self::Duplicate,
            Progress::Complete { .. } => Self::Complete,
            Progress::Heartbeat => Self::Heartbeat,
            Progress::Hello => Self::Hello,
            _ => Self::Stored,
        }
    }
}

/// The outcome of a slice of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_advance {
    /// No complete frame waits to be checked.
    Idle = 0,
    /// More work is left.
    Pending = 1,
    /// The frame is admitted, but the previous one is being read: a later call publishes it.
    Held = 2,
    /// The frame is published.
    Published = 3,
}

impl From<Advance> for dibs_advance {
    fn from(advance: Advance) -> Self {
        match advance {
            Advance::Pending => Self::Pending,
            Advance::Held { .. } => Self::Held,
            Advance::Published { .. } => Self::Published,
            _ => Self::Idle,
        }
    }
}

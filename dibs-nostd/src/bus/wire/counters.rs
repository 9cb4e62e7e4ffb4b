//! A receiver's counters, in the protocol's order.

use core::fmt;

use super::StatusReport;

/// Events of packets and frames at a receiver, in the order of their counters on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Event {
    /// A frame was published.
    Published,
    /// A frame was abandoned because another began.
    Abandoned,
    /// A packet had come before, and was ignored.
    Duplicate,
    /// A heartbeat was taken.
    Heartbeat,
    /// Bytes between two zeros of a stream were not a packet.
    Framing,
    /// The checksum is wrong, or the packet is too short for one.
    Damaged,
    /// Another protocol version.
    Version,
    /// The checksum is right but the form is wrong: the sender's fault.
    Malformed,
    /// A packet of another mesh.
    WrongMesh,
    /// The tag is wrong, or missing where one is required.
    Forged,
    /// Session or epoch not later than the published frame's.
    Stale,
    /// A packet of a frame that is not being received.
    Unexpected,
    /// A frame began while the previous one was still being checked.
    Busy,
    /// A partial frame on another base than the published frame.
    Base,
    /// Rows of a partial frame came before the published frame's rows were copied.
    NotReady,
    /// Another number of rows than this receiver's.
    RowCount,
    /// Another content or encoding than the frame's, or than this receiver takes.
    Encoding,
    /// Rows outside the surface.
    OutOfRange,
    /// Rows not in the order of the packets' sequence.
    Order,
    /// Too many gaps in the sequence.
    Gaps,
    /// A coordinate that is infinite or not a number.
    NotFinite,
    /// A coordinate larger than the receiver allows.
    TooFar,
    /// The packets do not add up to the commit's digest.
    Digest,
    /// The gate refused the surface: stretched too far, or not measured.
    Stretch,
    /// The gate refused the surface: a region has shrunk too far.
    Shrunk,
    /// The gate refused the surface: a vertex moved too fast.
    TooFast,
}

impl Event {
    /// Every event, in the order of the wire.
    pub const ALL: [Self; 26] = [
        Self::Published,
        Self::Abandoned,
        Self::Duplicate,
        Self::Heartbeat,
        Self::Framing,
        Self::Damaged,
        Self::Version,
        Self::Malformed,
        Self::WrongMesh,
        Self::Forged,
        Self::Stale,
        Self::Unexpected,
        Self::Busy,
        Self::Base,
        Self::NotReady,
        Self::RowCount,
        Self::Encoding,
        Self::OutOfRange,
        Self::Order,
        Self::Gaps,
        Self::NotFinite,
        Self::TooFar,
        Self::Digest,
        Self::Stretch,
        Self::Shrunk,
        Self::TooFast,
    ];

    /// Whether a packet or a frame was refused.
    #[must_use]
    pub const fn is_rejection(self) -> bool {
        self as u8 >= Self::Framing as u8
    }

    /// A short name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Abandoned => "abandoned",
            Self::Duplicate => "duplicate",
            Self::Heartbeat => "heartbeat",
            Self::Framing => "framing",
            Self::Damaged => "damaged",
            Self::Version => "version",
            Self::Malformed => "malformed",
            Self::WrongMesh => "wrong mesh",
            Self::Forged => "forged",
            Self::Stale => "stale",
            Self::Unexpected => "unexpected",
            Self::Busy => "busy",
            Self::Base => "base",
            Self::NotReady => "not ready",
            Self::RowCount => "row count",
            Self::Encoding => "encoding",
            Self::OutOfRange => "out of range",
            Self::Order => "order",
            Self::Gaps => "gaps",
            Self::NotFinite => "not finite",
            Self::TooFar => "too far",
            Self::Digest => "digest",
            Self::Stretch => "stretch",
            Self::Shrunk => "shrunk",
            Self::TooFast => "too fast",
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One saturating counter for each [`Event`], since the receiver's start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters([u32; Event::ALL.len()]);

impl Counters {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        Self([0; Event::ALL.len()])
    }

    /// The count of an event.
    #[must_use]
    pub fn of(&self, event: Event) -> u32 {
        self.0.get(event as usize).copied().unwrap_or(0)
    }

    /// All rejections together.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        let rejections = Event::ALL.into_iter().filter(|event| event.is_rejection());
        rejections.fold(0, |sum, event| sum.saturating_add(self.of(event)))
    }

    /// Copies the counters in a status: a sender's copy is complete after a few statuses. Counters of later protocol
    /// versions are skipped.
    pub fn update(&mut self, report: &StatusReport<'_>) {
        let places = self.0.iter_mut().skip(usize::from(report.first_counter));
        for (place, counter) in places.zip(report.counters) {
            *place = u32::from_le_bytes(*counter);
        }
    }

    pub(crate) fn count(&mut self, event: Event) {
        if let Some(counter) = self.0.get_mut(event as usize) {
            *counter = counter.saturating_add(1);
        }
    }

    /// The counters from this index on.
    pub(super) fn from(&self, first: usize) -> &[u32] {
        self.0.get(first..).unwrap_or_default()
    }
}

impl Default for Counters {
    fn default() -> Self {
        Self::new()
    }
}

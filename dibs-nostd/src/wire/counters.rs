//! A receiver's counters, in the protocol's order.

// Requirement: B-02

use core::ffi::CStr;
use core::fmt;

use super::StatusReport;

/// Defines [`Event`] from the one table of events: description, variant, name.
macro_rules! events {
    ($($(#[$description:meta])* $event:ident: $name:literal,)*) => {
        /// Events of packets and frames at a receiver, in the order of their counters on the wire.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum Event {
            $($(#[$description])* $event,)*
        }

        impl Event {
            /// Every event, in the order of the wire.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$event),*];

            /// A short name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$event => $name,)*
                }
            }

            /// The same for C.
            #[doc(hidden)]
            #[must_use]
            pub const fn c_name(self) -> &'static CStr {
                let name = match self {
                    $(Self::$event => concat!($name, "\0"),)*
                };
                match CStr::from_bytes_with_nul(name.as_bytes()) {
                    Ok(name) => name,
                    Err(_) => c"",
                }
            }
        }
    };
}

events! {
    /// A frame was published.
    Published: "published",
    /// A frame was abandoned because another began.
    Abandoned: "abandoned",
    /// A packet had arrived before, and was ignored.
    Duplicate: "duplicate",
    /// A heartbeat was accepted.
    Heartbeat: "heartbeat",
    /// Bytes between two zeros of a stream were not a packet.
    Framing: "framing",
    /// The checksum is wrong, or the packet is too short for one.
    Damaged: "damaged",
    /// Another protocol version.
    Version: "version",
    /// The checksum is right but the form is wrong: an error of the sender.
    Malformed: "malformed",
    /// A packet of another mesh.
    WrongMesh: "wrong mesh",
    /// The tag is wrong, or missing where one is required.
    Forged: "forged",
    /// Session or epoch not later than the published frame's.
    Stale: "stale",
    /// A packet of a frame that is not being received.
    Unexpected: "unexpected",
    /// A frame began while the previous one was still being checked.
    Busy: "busy",
    /// A partial frame whose base is not the published frame.
    Base: "base",
    /// Rows of a partial frame arrived before the published frame's rows were copied.
    NotReady: "not ready",
    /// Another number of rows than this receiver's.
    RowCount: "row count",
    /// Another content or encoding than the frame's, or one that this receiver does not accept.
    Encoding: "encoding",
    /// Rows outside the surface.
    OutOfRange: "out of range",
    /// Rows not in the order of the packets' sequence.
    Order: "order",
    /// Too many gaps in the sequence.
    Gaps: "gaps",
    /// A coordinate that is infinite or not a number.
    NotFinite: "not finite",
    /// A coordinate beyond the receiver's limit.
    TooFar: "too far",
    /// The packets do not match the commit's digest.
    Digest: "digest",
    /// The admission check refused the surface: stretched too far, or not measured.
    Stretch: "stretch",
    /// The admission check refused the surface: a region has shrunk too far.
    Shrunk: "shrunk",
    /// The admission check refused the surface: a vertex moved too fast.
    TooFast: "too fast",
    /// A hello without a tag came too soon after one that is answered.
    Throttled: "throttled",
}

impl Event {
    /// Whether the event is the refusal of a packet or frame.
    #[must_use]
    pub const fn is_rejection(self) -> bool {
        self as u8 >= Self::Framing as u8
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One saturating counter for each [`Event`], since the receiver's start.
///
/// It prints those that are not 0, by name:
///
/// ```
/// let mut counters = dibs_nostd::wire::Counters::new();
/// assert_eq!(counters.to_string(), "no events");
/// assert_eq!(format!("{counters:?}"), "{}");
/// # use dibs_nostd::{Assembler, Frames, Millis, NoAdmissionCheck};
/// # let frames = Frames::<3>::new();
/// # let mut assembler = Assembler::new(frames.split().unwrap().0, NoAdmissionCheck, 7, 1e3);
/// assembler.accept(&[1, 2, 3], Millis(0)).unwrap_err();
/// assert_eq!(assembler.counters().to_string(), "damaged 1");
/// assert_eq!(format!("{:?}", assembler.counters()), r#"{"damaged": 1}"#);
/// ```
#[derive(Clone, Copy, PartialEq, Eq)]
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

    /// The sum of all rejections.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        let rejections = Event::ALL.into_iter().filter(|event| event.is_rejection());
        rejections.fold(0, |sum, event| sum.saturating_add(self.of(event)))
    }

    /// Copies the counters of a status: after a few statuses the sender has all of them. Counters of later protocol
    /// versions are skipped.
    pub fn update(&mut self, report: &StatusReport<'_>) {
        let slots = self.0.iter_mut().skip(usize::from(report.first_counter));
        for (slot, counter) in slots.zip(report.counters) {
            *slot = u32::from_le_bytes(*counter);
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

impl Counters {
    /// Each event that happened, with its count.
    pub fn iter(&self) -> impl Iterator<Item = (Event, u32)> {
        Event::ALL.into_iter().zip(self.0).filter(|&(_, count)| count != 0)
    }
}

/// The events that happened.
impl fmt::Debug for Counters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter().map(|(event, count)| (event.name(), count))).finish()
    }
}

/// The events that happened.
impl fmt::Display for Counters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut events = self.iter();
        let Some((event, count)) = events.next() else { return f.write_str("no events") };
        write!(f, "{event} {count}")?;
        events.try_for_each(|(event, count)| write!(f, ", {event} {count}"))
    }
}

/// The events that happened.
#[cfg(feature = "defmt")]
impl defmt::Format for Counters {
    fn format(&self, f: defmt::Formatter<'_>) {
        for (event, count) in self.iter() {
            defmt::write!(f, "{=str} {=u32} ", event.name(), count);
        }
    }
}

impl Default for Counters {
    fn default() -> Self {
        Self::new()
    }
}

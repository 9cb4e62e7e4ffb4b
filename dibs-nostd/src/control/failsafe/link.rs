//! What the bus side knows of its own health, for the control tick.

use core::sync::atomic::{AtomicU32, Ordering};

use super::elapsed;
use crate::{Advance, Progress, Rejection};

/// The health of the bus at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Link {
    /// Time since the last good packet; `u32::MAX` before the first.
    pub silence: u32,
    /// Time since the last heartbeat; `u32::MAX` before the first.
    pub heartbeat: u32,
    /// Packets and frames rejected since the last frame was published.
    pub rejections: u32,
}

/// Where the bus interrupt notes what came, and the control tick reads it. Meant for a `static`.
///
/// Neither waits for the other; each number is exact, together they may be of two moments.
///
/// ```
/// use dibs_nostd::{Progress, failsafe::LinkStatus};
///
/// static LINK: LinkStatus = LinkStatus::new();
/// assert_eq!(LINK.read(5).silence, u32::MAX, "nothing came yet");
/// LINK.note(&Ok(Progress::Complete { epoch: 7 }), 10); // what `Assembler::accept` returned, when
/// assert_eq!(LINK.read(12).silence, 2);
/// ```
#[derive(Debug, Default)]
pub struct LinkStatus {
    packet: AtomicU32,
    heartbeat: AtomicU32,
    rejections: AtomicU32,
    /// Bit 0: a packet came. Bit 1: a heartbeat came.
    seen: AtomicU32,
}

const PACKET: u32 = 1;
const HEARTBEAT: u32 = 2;

impl LinkStatus {
    /// Nothing came yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            packet: AtomicU32::new(0),
            heartbeat: AtomicU32::new(0),
            rejections: AtomicU32::new(0),
            seen: AtomicU32::new(0),
        }
    }

    /// Notes what a packet came to, at the receiver's clock `now`. One writer.
    pub fn note(&self, outcome: &Result<Progress, Rejection>, now: u32) {
        match outcome {
            Err(_) => self.damaged(),
            Ok(progress) => {
                self.packet.store(now, Ordering::Relaxed);
                let seen = self.seen.load(Ordering::Relaxed);
                self.seen.store(seen | PACKET, Ordering::Release);
                if *progress == Progress::Heartbeat {
                    self.heartbeat(now);
                }
            }
        }
    }

    /// Notes what a slice of checking came to: `Assembler::advance`.
    pub fn note_check(&self, outcome: &Result<Advance, Rejection>) {
        match outcome {
            Err(_) => self.damaged(),
            Ok(Advance::Published { .. }) => self.rejections.store(0, Ordering::Relaxed),
            Ok(_) => (),
        }
    }

    /// Notes a heartbeat, at the receiver's clock `now`.
    pub fn heartbeat(&self, now: u32) {
        self.heartbeat.store(now, Ordering::Relaxed);
        let seen = self.seen.load(Ordering::Relaxed);
        self.seen.store(seen | HEARTBEAT, Ordering::Release);
    }

    /// Notes damage that never became a packet: a frame of the byte stream that was cut or too long.
    pub fn damaged(&self) {
        let streak = self.rejections.load(Ordering::Relaxed).saturating_add(1);
        self.rejections.store(streak, Ordering::Relaxed);
    }

    /// The health of the bus at `now`.
    #[must_use]
    pub fn read(&self, now: u32) -> Link {
        let seen = self.seen.load(Ordering::Acquire);
        let since = |bit: u32, at: &AtomicU32| {
            if seen & bit == 0 { u32::MAX } else { elapsed(now, at.load(Ordering::Relaxed)) }
        };
        Link {
            silence: since(PACKET, &self.packet),
            heartbeat: since(HEARTBEAT, &self.heartbeat),
            rejections: self.rejections.load(Ordering::Relaxed),
        }
    }
}

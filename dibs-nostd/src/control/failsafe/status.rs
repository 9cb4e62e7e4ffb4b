//! The health of the bus, passed to the control tick.

// Requirements: B-05, C-01

use core::sync::atomic::{AtomicU32, Ordering};

use super::Link;
use crate::receive::BusHealth;
use crate::surface::{Millis, StampAge};

/// Passes the bus's health from the bus interrupt to the control tick. Meant for a `static`.
///
/// Neither side waits for the other. Each number is exact, but two of them may be of different moments.
///
/// ```
/// use dibs_nostd::wire::{FrameId, NoMac, encode_heartbeat};
/// use dibs_nostd::{Assembler, Frames, Millis, NoAdmissionCheck, failsafe::LinkStatus};
///
/// static FRAMES: Frames<3> = Frames::new();
/// static LINK: LinkStatus = LinkStatus::new();
/// assert_eq!(LINK.read(Millis(5)).silence, Millis::MAX, "nothing came yet");
///
/// // Bus interrupt: after each call of `accept` or `advance`.
/// let (writer, _reader) = FRAMES.split().unwrap();
/// let mut assembler = Assembler::new(writer, NoAdmissionCheck, 0xB0D1, 1000.0);
/// let mut buffer = [0; 64];
/// let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch: 0 };
/// assembler.accept(encode_heartbeat(&id, 1, None, &NoMac, &mut buffer), Millis(10)).unwrap();
/// LINK.set(&assembler.health());
///
/// // Control interrupt.
/// assert_eq!(LINK.read(Millis(12)).silence, Millis(2));
/// ```
#[derive(Debug)]
pub struct LinkStatus {
    packet: Stamp,
    heartbeat: Stamp,
    rejections: AtomicU32,
    forgeries: AtomicU32,
    transit: AtomicU32,
    source_age: AtomicU32,
}

/// The time of the last packet or heartbeat, and the greatest age found for it.
#[derive(Debug)]
struct Stamp {
    /// 1 once a packet or heartbeat arrived.
    came: AtomicU32,
    at: AtomicU32,
    /// The reader's state: the last stamp read, and its age.
    aged: AtomicU32,
    oldest: AtomicU32,
}

impl Stamp {
    const fn new() -> Self {
        Self {
            came: AtomicU32::new(0),
            at: AtomicU32::new(0),
            aged: AtomicU32::new(0),
            oldest: AtomicU32::new(0),
        }
    }

    fn set(&self, at: Option<Millis>) {
        if let Some(Millis(at)) = at {
            self.at.store(at, Ordering::Relaxed);
            self.came.store(1, Ordering::Release);
        }
    }

    /// Time since the last one; [`Millis::MAX`] before the first.
    fn age(&self, now: Millis) -> Millis {
        if self.came.load(Ordering::Acquire) == 0 {
            return Millis::MAX;
        }
        let before = StampAge {
            stamp: Millis(self.aged.load(Ordering::Relaxed)),
            oldest: Millis(self.oldest.load(Ordering::Relaxed)),
        };
        let StampAge { stamp, oldest } = before.at(now, Millis(self.at.load(Ordering::Relaxed)));
        self.aged.store(stamp.0, Ordering::Relaxed);
        self.oldest.store(oldest.0, Ordering::Relaxed);
        oldest
    }
}

impl LinkStatus {
    /// No packet or heartbeat yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            packet: Stamp::new(),
            heartbeat: Stamp::new(),
            rejections: AtomicU32::new(0),
            forgeries: AtomicU32::new(0),
            transit: AtomicU32::new(u32::MAX),
            source_age: AtomicU32::new(u32::MAX),
        }
    }

    /// Notes the health of the bus: after each packet and each slice of checking. One writer.
    pub fn set(&self, health: &BusHealth) {
        self.packet.set(health.packet);
        self.heartbeat.set(health.heartbeat);
        self.rejections.store(health.rejections, Ordering::Relaxed);
        self.forgeries.store(health.forgeries, Ordering::Relaxed);
        self.transit.store(health.transit.0, Ordering::Relaxed);
        self.source_age.store(health.source_age.0, Ordering::Relaxed);
    }

    /// The health of the bus at `now`. There is one reader, which calls it at least once in 2^31 ms: then a lost link
    /// stays lost when the clock wraps.
    #[must_use]
    pub fn read(&self, now: Millis) -> Link {
        Link {
            silence: self.packet.age(now),
            heartbeat: self.heartbeat.age(now),
            rejections: self.rejections.load(Ordering::Relaxed),
            forgeries: self.forgeries.load(Ordering::Relaxed),
            transit: Millis(self.transit.load(Ordering::Relaxed)),
            source_age: Millis(self.source_age.load(Ordering::Relaxed)),
        }
    }
}

const _: () = assert!(Link::MOST_FORGERIES == BusHealth::MOST_FORGERIES);

impl Default for LinkStatus {
    fn default() -> Self {
        Self::new()
    }
}

//! The bus's health, as numbers for a fail-safe machine.

// Requirement: B-04

use super::ReceiveError;
use crate::surface::Millis;
use crate::wire::{FrameId, Packet, is_newer};

/// The health of the bus, as the receiver sees it, for [`LinkStatus::set`](crate::failsafe::LinkStatus::set). Times are
/// on the receiver's clock.
///
/// With a key only packets with a genuine tag count as rejections, so that nobody without the key can add or hide any.
/// Damaged and stray packets count only in [`Counters`](crate::wire::Counters); the frames that they spoil count here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct BusHealth {
    /// Time of the last accepted packet; repeated packets and hellos do not count.
    pub packet: Option<Millis>,
    /// Latest time at which the sender is known to have been alive: that of the status that a heartbeat echoed, or
    /// without an echo the heartbeat's arrival.
    pub heartbeat: Option<Millis>,
    /// Frames refused, abandoned or without a begin since the last publication: each once, unless more than four frames
    /// alternate. Packets of other meshes and of finished frames do not count.
    pub rejections: u32,
    /// Packets without a genuine tag, less [`FORGERIES_A_SECOND`](Self::FORGERIES_A_SECOND), at most
    /// [`MOST_FORGERIES`](Self::MOST_FORGERIES). The first publication resets it to 0, because before it the sender did
    /// not know the receiver's challenge. Later ones do not.
    pub forgeries: u32,
    /// Time from the status that the published frame echoes to the arrival of its begin packet: an upper bound on the
    /// latency of either. [`Millis::MAX`] if it echoes none. Once the next frame is complete, the greater of both frames.
    pub transit: Millis,
    /// Age of the published frame when it was sent, as the sender stated it. As with the transit, the greater of both frames.
    pub source_age: Millis,
}

impl BusHealth {
    /// Forgeries subtracted each second: a lasting rate up to this never exceeds a limit.
    pub const FORGERIES_A_SECOND: u32 = 1_000 / DRAIN_MS;

    /// Largest count of forgeries, so that a flood decays within `MOST_FORGERIES / FORGERIES_A_SECOND` seconds.
    pub const MOST_FORGERIES: u32 = 1_000;
}

/// Time (ms) after which one forgery is subtracted.
const DRAIN_MS: u32 = 100;

/// The part of a frame's name that every packet carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameName {
    session_low: u16,
    epoch: u32,
}

impl FrameName {
    pub const fn of(id: &FrameId) -> Self {
        Self { session_low: id.session as u16, epoch: id.epoch }
    }

    pub const fn of_packet(packet: &Packet<'_>) -> Self {
        Self { session_low: packet.session_low, epoch: packet.epoch }
    }
}

/// Number of frame names remembered as counted.
const REMEMBERED: usize = 4;

/// The failed frames since the last publication, and the forgeries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trouble {
    rejections: u32,
    /// The last counted frames, the newest first.
    counted: [Option<FrameName>; REMEMBERED],
    forgeries: Bucket,
}

impl Trouble {
    pub const fn new() -> Self {
        Self { rejections: 0, counted: [None; REMEMBERED], forgeries: Bucket::EMPTY }
    }

    /// Rejections and forgeries.
    pub const fn counts(&self, now: Millis) -> (u32, u32) {
        (self.rejections, self.forgeries.level(now))
    }

    /// Notes a publication.
    pub const fn note_published(&mut self, is_first: bool) {
        let forgeries = if is_first { Bucket::EMPTY } else { self.forgeries };
        *self = Self { forgeries, ..Self::new() };
    }

    /// Notes that a packet, or the frame of this name, was rejected. With a key (`is_keyed`) only packets with a
    /// genuine tag count as rejections.
    pub fn note(&mut self, name: FrameName, rejection: &ReceiveError, is_keyed: bool, now: Millis) {
        match rejection {
            ReceiveError::Forged { .. } => self.forgeries.add(now),
            ReceiveError::Packet(_)
            | ReceiveError::WrongMesh { .. }
            | ReceiveError::Stale { .. }
            | ReceiveError::Unverifiable { .. }
            | ReceiveError::Throttled { .. }
            | ReceiveError::ForSenders => (),
            _ => self.note_frame(name, is_keyed),
        }
    }

    /// Notes that a frame was refused or abandoned.
    pub fn note_frame(&mut self, name: FrameName, is_keyed: bool) {
        let [newest, before @ ..] = &self.counted;
        let is_recorded = |newest: &FrameName| {
            newest.session_low == name.session_low && !is_newer(name.epoch, newest.epoch)
        };
        // Names with a genuine tag only increase, so an earlier one is a replay. Without a key the earlier one may be
        // the genuine one.
        let is_counted = self.counted.contains(&Some(name))
            || is_keyed && newest.as_ref().is_some_and(is_recorded);
        if !is_counted {
            self.rejections = self.rejections.saturating_add(1);
            let [second, third, _] = *before;
            self.counted = [Some(name), *newest, second, third];
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    level: u32,
    /// The receiver's clock at the last drop that drained.
    drained: Millis,
}

impl Bucket {
    const EMPTY: Self = Self { level: 0, drained: Millis(0) };

    /// Drops drained since then; none if the clock went back.
    const fn drops(&self, now: Millis) -> u32 {
        let Millis(elapsed) = now.since(self.drained);
        if elapsed > i32::MAX as u32 { 0 } else { elapsed / DRAIN_MS }
    }

    const fn level(&self, now: Millis) -> u32 {
        self.level.saturating_sub(self.drops(now))
    }

    fn add(&mut self, now: Millis) {
        let (level, drops) = (self.level(now), self.drops(now));
        self.drained = match level {
            0 => now,
            _ => self.drained.after(Millis(drops.wrapping_mul(DRAIN_MS))),
        };
        self.level = if level < BusHealth::MOST_FORGERIES { level + 1 } else { level };
    }
}

//! The bus's health, in numbers that a fail-safe machine watches.

use super::ReceiveError;
use crate::bus::wire::{FrameId, Packet, is_newer};
use crate::surface::Millis;

/// The health of the bus, as the receiver sees it, for [`LinkStatus::set`](crate::failsafe::LinkStatus::set). Times are
/// on the receiver's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct BusHealth {
    /// Time of the last packet taken; repeated packets and hellos do not count.
    pub packet: Option<Millis>,
    /// Time of the last heartbeat taken.
    pub heartbeat: Option<Millis>,
    /// Frames refused or damaged since the last publication, each counted once, however many of its packets were
    /// rejected. Forged packets, packets of other meshes, and packets of frames that are over do not count.
    pub rejections: u32,
    /// Packets without a genuine tag since the last frame was published.
    pub forgeries: u32,
    /// Time from the status that the published frame echoes to the arrival of its begin packet: an upper bound on the
    /// way of each. [`Millis::MAX`] where it echoes none.
    pub transit: Millis,
    /// Age of the published frame when it was sent, as the sender stated it.
    pub source_age: Millis,
}

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

    const fn is_after(self, other: Self) -> bool {
        if self.session_low == other.session_low {
            is_newer(self.epoch, other.epoch)
        } else {
            self.session_low.wrapping_sub(other.session_low) as i16 > 0
        }
    }
}

/// The frames that went wrong since the last publication.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trouble {
    rejections: u32,
    forgeries: u32,
    last: Last,
}

/// The frame that was counted last.
#[derive(Clone, Copy, Debug)]
enum Last {
    /// No frame since the last begin.
    None,
    /// A frame without a name: its bytes were damaged.
    Unnamed,
    Named(FrameName),
}

impl Trouble {
    pub const fn new() -> Self {
        Self { rejections: 0, forgeries: 0, last: Last::None }
    }

    /// Rejections and forgeries.
    pub const fn counts(&self) -> (u32, u32) {
        (self.rejections, self.forgeries)
    }

    /// A frame began.
    pub const fn note_begin(&mut self) {
        self.last = Last::None;
    }

    /// Bytes or a packet without a name were rejected.
    pub const fn note_damage(&mut self) {
        if let Last::None = self.last {
            self.rejections = self.rejections.saturating_add(1);
            self.last = Last::Unnamed;
        }
    }

    /// A packet or frame was rejected; `in_work` names the frame in work.
    pub fn note(
        &mut self,
        name: Option<FrameName>,
        in_work: Option<FrameName>,
        rejection: &ReceiveError,
    ) {
        let name = match (rejection, name) {
            (ReceiveError::Forged { .. }, _) => {
                self.forgeries = self.forgeries.saturating_add(1);
                return;
            }
            (ReceiveError::WrongMesh { .. } | ReceiveError::Stale { .. }, _) => return,
            (_, None) => return self.note_damage(),
            (_, Some(name)) => name,
        };
        // The packet is of a frame that was abandoned.
        if in_work.is_some_and(|in_work| in_work.is_after(name)) {
            return;
        }
        match self.last {
            Last::Named(last) if !name.is_after(last) => return,
            // The damage counted already was probably this frame's.
            Last::Unnamed => (),
            _ => self.rejections = self.rejections.saturating_add(1),
        }
        self.last = Last::Named(name);
    }
}

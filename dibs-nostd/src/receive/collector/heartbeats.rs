//! Heartbeats: which are accepted, and when the sender is known to have been alive.

// Requirement: B-05

use super::Collector;
use crate::ReceiveError;
use crate::surface::{Millis, elapsed};
use crate::wire::{Heartbeat, Mac, Packet, is_newer};

/// The last heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LastHeartbeat {
    /// The sender's session.
    pub session: u32,
    /// The heartbeat's number.
    pub beat: u32,
    /// The newest epoch that the sender had begun.
    pub epoch: u32,
    /// The receiver's clock when it came.
    pub received: Millis,
}

/// Largest difference of two beat numbers that are attributed to one sender.
const LARGEST_GAP: u32 = 16;

impl Collector {
    /// Accepts a heartbeat, unless it is older than the last.
    pub fn heartbeat<M: Mac>(
        &mut self,
        packet: &Packet<'_>,
        heartbeat: Heartbeat,
        mac: &M,
    ) -> Result<(), ReceiveError> {
        let Heartbeat { session, beat, echo } = heartbeat;
        let epoch = packet.epoch;
        if !packet.is_genuine(mac, session) {
            return Err(ReceiveError::Forged { epoch });
        }
        let before_published =
            self.published.is_some_and(|published| is_newer(published.id.session, session));
        let before_last = self.heartbeat.is_some_and(|last| {
            if last.session == session {
                !is_newer(beat, last.beat)
            } else {
                !is_newer(session, last.session)
            }
        });
        // Without a key one stray heartbeat with a far later number must not cause all genuine ones to be refused. Two
        // successive heartbeats in order are taken for a sender's; a repeated one is not.
        let is_in_order = !M::TAGGED
            && self.heartbeat.is_none_or(|last| last.beat != beat)
            && self.straggler.is_some_and(|(of, before)| {
                of == session && (1..=LARGEST_GAP).contains(&beat.wrapping_sub(before))
            });
        if before_published || before_last && !is_in_order {
            self.straggler = Some((session, beat));
            return Err(ReceiveError::Stale { epoch });
        }
        self.heartbeat = Some(LastHeartbeat { session, beat, epoch, received: self.now });
        self.note_alive(echo);
        Ok(())
    }

    /// The sender was alive when it received the status that it echoes; without an echo, the arrival counts. So a
    /// delayed heartbeat counts with its delay. An echo ahead of this clock is from another run and is ignored.
    pub(in crate::receive) fn note_alive(&mut self, echo: Option<u32>) {
        let at = echo.map_or(self.now, Millis);
        // An echo at most [`AHEAD`] ahead of this clock counts as now.
        let age = elapsed(self.now, at);
        let at = if age == Millis(0) { self.now } else { at };
        // Ages are compared, not readings, which wrap.
        let is_later = self.alive_at.is_none_or(|last| age <= self.now.since(last));
        if age.0 <= i32::MAX as u32 && is_later {
            self.alive_at = Some(at);
        }
    }
}

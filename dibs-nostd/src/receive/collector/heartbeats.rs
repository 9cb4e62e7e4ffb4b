//! Heartbeats: which are taken, and when the sender is known to have lived.

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
    /// Number of the heartbeat.
    pub beat: u32,
    /// The newest epoch that the sender had begun.
    pub epoch: u32,
    /// The receiver's clock when it came.
    pub received: Millis,
}

/// Largest difference of two beats that counts as one sender's.
const LARGEST_GAP: u32 = 16;

impl Collector {
    /// Takes a heartbeat, unless it is older than what has come.
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
        // Without a key one stray heartbeat from the far future must not refuse all genuine ones. Two in a row that are
        // in order are a sender's; a repeated one is not.
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

    /// The sender lived when it took the status that it echoes; without an echo, count its arrival. A delayed heartbeat
    /// therefore counts with its delay. An echo ahead of this clock is from another run and counts for nothing.
    pub(in crate::receive) fn note_alive(&mut self, echo: Option<u32>) {
        let at = echo.map_or(self.now, Millis);
        // An echo up to [`AHEAD`] ahead of this clock counts as now.
        let age = elapsed(self.now, at);
        let at = if age == Millis(0) { self.now } else { at };
        // Ages are compared, not readings, which wrap.
        let is_later = self.alive_at.is_none_or(|last| age <= self.now.since(last));
        if age.0 <= i32::MAX as u32 && is_later {
            self.alive_at = Some(at);
        }
    }
}

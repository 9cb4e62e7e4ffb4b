//! The sender's reaction to the receiver's statuses.

use dibs_nostd::wire::{Body, Counters, Mac, Packet, Status, StatusReport, encode_hello, is_newer};

use super::greeting::Greeting;
use super::{SendError, Sender};
use crate::transport::Transport;

impl<T: Transport, M: Mac, const MTU: usize> Sender<T, MTU, M> {
    /// The frame of this session that the receiver last reported as published.
    #[must_use]
    pub fn acknowledged(&self) -> Option<u32> {
        let published = self.status?.published?;
        let is_own = published.session == self.settings.session
            && !is_newer(published.epoch, self.epoch)
            && is_newer(published.epoch, self.before);
        is_own.then_some(published.epoch)
    }

    /// Frames of this session sent after the last acknowledged one.
    #[must_use]
    pub fn in_flight(&self) -> u32 {
        self.epoch.wrapping_sub(self.acknowledged().unwrap_or(self.before))
    }

    /// Number of this run: that of the settings, or a later one that was free.
    #[must_use]
    pub const fn session(&self) -> u32 {
        self.settings.session
    }

    /// The receiver's last report.
    #[must_use]
    pub const fn status(&self) -> Option<&Status> {
        self.status.as_ref()
    }

    /// The receiver's counters, as last reported.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Sends hellos until the receiver answers, if its challenge is unknown or it may have started anew.
    pub(super) fn greet(&mut self) -> Result<(), SendError> {
        if !self.is_ready() {
            self.greeting.get_or_insert_with(Greeting::new);
        }
        let now = self.clock.now();
        let Some(nonce) = self.greeting.as_mut().and_then(|greeting| greeting.due(now)) else {
            return Ok(());
        };
        let mut buffer = [0; 64];
        let hello = encode_hello(&self.id(), nonce, &mut buffer).to_vec();
        self.put(&hello)
    }

    /// Takes a packet that came back. Only statuses of this mesh are for this sender.
    pub(super) fn take(&mut self, packet: &[u8]) {
        let Ok(packet) = Packet::decode(packet) else { return };
        let Body::Status(report) = packet.body else { return };
        let mac = (self.keyed_mac)(report.status.challenge);
        let session = report.status.published.map_or(0, |published| published.session);
        if packet.mesh_id == self.surface.mesh_id && packet.is_genuine(&mac, session) {
            self.take_status(&report, mac);
        }
    }

    /// Takes a genuine status, if it is new: the next one of the receiver's run, or the answer to a hello. Any other is
    /// a recording, was overtaken, or comes from a receiver that has started anew, which a hello decides.
    fn take_status(&mut self, report: &StatusReport<'_>, mac: M) {
        let status = report.status;
        let is_answer =
            self.greeting.is_some_and(|greeting| greeting.is_answered_by(status.answer));
        let is_same = self.mac.as_ref().is_some_and(|known| known.challenge() == mac.challenge());
        let is_later = self.status.is_none_or(|last| is_newer(status.number, last.number));
        let is_next = is_same && is_later;
        if !(is_answer || is_next) {
            self.greeting.get_or_insert_with(Greeting::new);
            return;
        }
        if is_answer {
            self.greeting = None;
        }
        if !is_next {
            // A receiver that has started anew has no frame.
            self.mac = Some(mac);
            self.whole_wanted = true;
        }
        self.counters.update(report);
        self.status = Some(status);
        self.totals.statuses += 1;
        self.yield_or_take_over();
        let now = self.clock.now();
        let is_answered = self.whole.is_some_and(|(epoch, at)| {
            let has_come = self.acknowledged().is_some_and(|newest| !is_newer(epoch, newest));
            has_come || now.saturating_sub(at) >= self.settings.patience
        });
        if is_answered && (status.wants_whole || self.acknowledged().is_none()) {
            self.whole_wanted = true;
        }
    }

    /// Reacts to a published frame that this sender has not sent: the receiver would refuse this sender's frames for
    /// ever.
    fn yield_or_take_over(&mut self) {
        let Some(published) = self.status.and_then(|status| status.published) else { return };
        let own = self.settings.session;
        if self.acknowledged().is_some() {
            self.is_established = true;
        } else if self.is_established && is_newer(published.session, own) {
            self.superseded = Some(published.session);
        } else if !is_newer(own, published.session) {
            // The frame is from before this sender's start, or another sender used the same session number.
            self.settings.session = published.session.wrapping_add(1);
            self.before = self.epoch;
            self.is_established = false;
            self.held = None;
            self.whole = None;
            self.whole_wanted = true;
        }
    }
}

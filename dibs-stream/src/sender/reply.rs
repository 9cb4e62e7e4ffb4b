//! How the sender reacts to the receiver's statuses.

use std::time::Duration;

use dibs_nostd::wire::{
    Body, Counters, Mac, Packet, PublishedStatus, Status, StatusAnswer, StatusReport, encode_hello,
    is_newer,
};

use super::greeting::Greeting;
use super::objection::{Cause, Objection};
use super::{SendError, Sender};
use crate::transport::Transport;

impl<T: Transport, M: Mac, const MTU: usize> Sender<T, MTU, M> {
    /// The epoch of the latest frame of this session that the receiver has reported as published.
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

    /// Session number: that of the settings, or a later one if that was taken.
    #[must_use]
    pub const fn session(&self) -> u32 {
        self.settings.session
    }

    /// The receiver's last status.
    #[must_use]
    pub const fn status(&self) -> Option<&Status> {
        self.status.as_ref()
    }

    /// The receiver's counters, as last reported.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Sends hellos until the receiver answers, if its challenge is unknown, it may have restarted, or its objection
    /// may be resolved.
    pub(super) fn greet(&mut self) -> Result<(), SendError> {
        let now = self.clock.now();
        let asks_again = self.objection.as_mut().is_some_and(|objection| objection.is_due(now));
        if !self.is_ready() || asks_again {
            self.ask();
        }
        let Some(nonce) = self.greeting.as_mut().and_then(|greeting| greeting.due(now)) else {
            return Ok(());
        };
        let mut buffer = [0; 64];
        // A hello's tag does not depend on the challenge.
        let mac = (self.keyed_mac)(0);
        let hello = encode_hello(&self.id(), nonce, &mac, &mut buffer);
        self.put(hello)
    }

    fn ask(&mut self) {
        self.greeting.get_or_insert_with(Greeting::new);
    }

    /// Returns the receiver's objection as an error, if it holds.
    pub(super) fn object(&self) -> Result<(), SendError> {
        let now = self.clock.now();
        match self.objection.filter(|objection| now >= objection.holds_from) {
            None => Ok(()),
            Some(Objection { cause: Cause::Superseded { session }, .. }) => {
                Err(SendError::Superseded { session })
            }
            Some(Objection { cause: Cause::OtherSurface { mesh_id, facts }, .. }) => {
                Err(SendError::OtherSurface {
                    there: (mesh_id, facts),
                    here: (self.surface.mesh_id, self.surface.facts),
                })
            }
        }
    }

    /// Handles a packet from the receiver.
    pub(super) fn take(&mut self, packet: &[u8]) {
        let Ok(packet) = Packet::decode(packet) else { return };
        let Body::Status(report) = packet.body else { return };
        let session = report.status.published.map_or(0, |published| published.session);
        let is_ours = packet.mesh_id == self.surface.mesh_id;
        let Some(answer) = report.status.answer else {
            let is_later =
                self.status.is_none_or(|last| is_newer(report.status.number, last.number));
            let is_genuine = self.mac.as_ref().is_some_and(|mac| packet.is_genuine(mac, session));
            // Anything else is a replay, was overtaken, or comes from a receiver that has restarted or has another
            // surface. A hello decides between these.
            if is_ours && is_genuine && is_later {
                self.take_status(&report, M::TAGGED);
            } else if is_ours || self.status.is_none() {
                self.ask();
            }
            return;
        };
        let mac = (self.keyed_mac)(answer.challenge);
        let is_answer = self.greeting.is_some_and(|greeting| greeting.is_answered_by(&answer));
        if is_answer && packet.is_genuine(&mac, session) {
            self.take_answer(packet.mesh_id, &report, &answer, mac);
        }
    }

    /// Handles an authentic answer to the pending hello.
    fn take_answer(
        &mut self,
        mesh_id: u32,
        report: &StatusReport<'_>,
        answer: &StatusAnswer,
        mac: M,
    ) {
        let facts = answer.surface;
        let (is_ours, now) = (mesh_id == self.surface.mesh_id, self.clock.now());
        if !is_ours || !facts.agrees_with(&self.surface.facts) {
            // Without a key, the answer may come from another surface's receiver on the same line.
            let is_certain = M::TAGGED || is_ours;
            if is_certain || self.status.is_none() {
                let wait = if is_certain { Duration::ZERO } else { self.settings.patience };
                let cause = Cause::OtherSurface { mesh_id, facts };
                let holds_from = match self.objection {
                    Some(before) if before.cause == cause => before.holds_from,
                    _ => now + wait,
                };
                self.objection = Some(Objection::new(cause, now, holds_from));
            }
            if is_certain {
                self.greeting = None;
            }
            return;
        }
        self.greeting = None;
        self.objection = None;
        self.is_compared = true;
        let is_same = self.mac.as_ref().is_some_and(|known| known.challenge() == mac.challenge());
        let is_later = self.status.is_none_or(|last| is_newer(report.status.number, last.number));
        if !(is_same && is_later) {
            // A receiver that has restarted has no frame.
            self.mac = Some(mac);
            self.whole_wanted = true;
        }
        self.take_status(report, true);
    }

    /// Handles a new status. `is_certain` means that it is authentic: it has a tag, or answers a hello.
    fn take_status(&mut self, report: &StatusReport<'_>, is_certain: bool) {
        let mut status = report.status;
        if let (Some(_), Some(published)) = (status.answer, &mut status.published) {
            // An answer does not state the stretch.
            let known = self.status.and_then(|last| last.published);
            let is_known = |last: &PublishedStatus| {
                (last.session, last.epoch) == (published.session, published.epoch)
            };
            published.stretch = known.filter(is_known).and_then(|last| last.stretch);
        }
        self.counters.update(report);
        self.status = Some(status);
        self.totals.statuses += 1;
        if !self.is_compared {
            self.ask();
        }
        self.yield_or_take_over(is_certain);
        let now = self.clock.now();
        let is_answered = self.whole.is_some_and(|(epoch, at)| {
            let has_come = self.acknowledged().is_some_and(|newest| !is_newer(epoch, newest));
            has_come || now.saturating_sub(at) >= self.settings.patience
        });
        if is_answered && (status.wants_whole || self.acknowledged().is_none()) {
            self.whole_wanted = true;
        }
    }

    /// Handles a published frame that this sender has not sent: the receiver would never accept this sender's frames.
    /// If the status is not certainly authentic, a hello decides.
    fn yield_or_take_over(&mut self, is_certain: bool) {
        let Some(published) = self.status.and_then(|status| status.published) else { return };
        let own = self.settings.session;
        let is_ours = self.acknowledged().is_some();
        if is_ours {
            self.is_established = true;
        } else if !is_certain {
            self.ask();
        } else if self.is_established && is_newer(published.session, own) {
            let (now, cause) = (self.clock.now(), Cause::Superseded { session: published.session });
            self.objection = Some(Objection::new(cause, now, now));
        } else if !is_newer(own, published.session) {
            // The frame was sent before this sender started, or another sender used the same session number.
            self.settings.session = published.session.wrapping_add(1);
            self.before = self.epoch;
            self.is_established = false;
            self.held = None;
            self.whole = None;
            self.whole_wanted = true;
        }
    }
}

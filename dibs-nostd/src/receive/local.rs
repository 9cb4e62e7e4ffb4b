//! Whole frames of this process, without packets: the same checks and the same admission check.

// Requirement: B-08

use glam::Vec3;

use super::health::FrameName;
use super::packets::check;
use super::{Assembler, Progress, ReceiveError};
use crate::stretch::AdmissionCheck;
use crate::surface::{Millis, Position, RigidPose, elapsed};
use crate::wire::{Begin, Content, Encoding, FrameId, Freshness, Mac};

impl<G: AdmissionCheck, M: Mac> Assembler<'_, G, M> {
    /// Takes a whole frame from this process, for example from a solver's thread: the positions (mm) of all rows, in
    /// the rows' order, captured at `captured`, at most 65.5 s before `now` on the receiver's clock. As after a frame's
    /// last packet, [`advance`](Self::advance) then checks and publishes it.
    ///
    /// The call counts as a sign of life, like a heartbeat, and its transit time is 0. Use one source at a time: a
    /// frame of packets that is still being received is abandoned.
    ///
    /// Cost: O(rows), several reads of each row.
    ///
    /// # Errors
    /// [`ReceiveError`], counted: another number of rows, a position that is not finite or too far away, a capture too
    /// old or earlier than the published one's, weights expected, or a complete frame still being checked
    /// ([`Busy`](ReceiveError::Busy)). The published and the current frame stay.
    pub fn frame(
        &mut self,
        positions: impl ExactSizeIterator<Item = Vec3> + Clone,
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        self.frame_at(positions, (None, 0.0), [captured, now])
    }

    /// The same, with a pose, and with the largest error (mm) of a position.
    pub(crate) fn frame_at(
        &mut self,
        positions: impl ExactSizeIterator<Item = Vec3> + Clone,
        besides: (Option<RigidPose>, f32),
        times: [Millis; 2],
    ) -> Result<Progress, ReceiveError> {
        let (limit, rows, checked) = (self.max_coordinate, positions.len(), positions.clone());
        let source = move |_: &Self| check(checked, 0, limit);
        let store = move |slots: &[Position]| {
            for (slot, position) in slots.iter().zip(positions) {
                slot.set(position);
            }
        };
        self.local((Content::Whole, rows), besides, source, store, times)
    }

    /// The same, with weights of displacement modes.
    ///
    /// # Errors
    /// As [`frame`](Self::frame); [`ReceiveError::TooFar`] for a weight out of its mode's range.
    pub fn frame_of_weights(
        &mut self,
        weights: &[f32],
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        let source = |this: &Self| {
            (0..).zip(weights).try_for_each(|(row, &weight)| this.check_weight(row, weight))
        };
        let store = |slots: &[Position]| {
            // As a row, so that vertices, nodes and weights have the same buffers: 8 bytes more for each of a few weights.
            for (slot, &weight) in slots.iter().zip(weights) {
                slot.set(Vec3::new(weight, 0.0, 0.0));
            }
        };
        self.local((Content::Modal, weights.len()), (None, 0.0), source, store, [captured, now])
    }

    /// Refuses and counts a frame of this process.
    #[cold]
    pub(crate) fn refuse_frame(&mut self, rejection: ReceiveError, now: Millis) -> ReceiveError {
        self.collector.set_now(now);
        let id = self.collector.next_id();
        self.refuse_local(&id, rejection)
    }

    #[cold]
    fn refuse_local(&mut self, id: &FrameId, rejection: ReceiveError) -> ReceiveError {
        self.collector.refuse::<M>(FrameName::of(id), true, &rejection);
        rejection
    }

    /// Takes a frame whose rows `check` accepts and `store` stores.
    fn local(
        &mut self,
        (content, rows): (Content, usize),
        besides: (Option<RigidPose>, f32),
        check: impl FnOnce(&Self) -> Result<(), ReceiveError>,
        store: impl FnOnce(&[Position]),
        [captured, now]: [Millis; 2],
    ) -> Result<Progress, ReceiveError> {
        self.collector.set_now(now);
        let id = self.collector.next_id();
        let rows = u32::try_from(rows).unwrap_or(u32::MAX);
        let age_ms = u16::try_from(elapsed(now, captured).0).unwrap_or(u16::MAX);
        let begin = Begin {
            session: id.session,
            content,
            encoding: Encoding::Float,
            rows,
            surface: self.surface_facts(),
            freshness: Freshness { age_ms, echo: Some(now.0) },
            is_posed: false,
        };
        let outcome = self.local_rows(id, begin, besides, check, store);
        let outcome = outcome.map_err(|rejection| self.refuse_local(&id, rejection));
        if outcome.is_ok() {
            self.collector.note_local();
        }
        outcome
    }

    fn local_rows(
        &mut self,
        id: FrameId,
        begin: Begin,
        (pose, error): (Option<RigidPose>, f32),
        check: impl FnOnce(&Self) -> Result<(), ReceiveError>,
        store: impl FnOnce(&[Position]),
    ) -> Result<Progress, ReceiveError> {
        let (rows, takes_weights) = (begin.rows, self.admission_check.weight_range(0).is_some());
        if rows != self.writer.len() {
            return Err(ReceiveError::RowCount { rows });
        }
        if takes_weights != (begin.content == Content::Modal) {
            return Err(ReceiveError::Encoding);
        }
        check(self)?;
        // Like a frame of one packet, with digest contributions of 0.
        self.begin_frame(id.epoch, begin, [0; 2])?;
        self.collector.set_error(error);
        if let Some(pose) = pose {
            self.admission_check.place(pose);
        }
        let misplaced = ReceiveError::OutOfRange { first: 0, count: rows };
        let position = self.collector.locate_whole(rows).ok_or(misplaced)?;
        store(self.writer.rows(0..rows).ok_or(misplaced)?);
        self.stored(id.epoch, 0, position, 0..rows)
    }
}

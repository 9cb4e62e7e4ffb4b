//! The first half of sending: a frame's packets, made from positions or weights.

use std::time::Duration;

use dibs_nostd::RigidPose;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Content, FrameEncoder, Freshness, Mac, WeightsEncoder};

use super::frame::{Packets, apply};
use super::{PreparedFrame, SendError, Sender, SentFrame};
use crate::transport::Transport;

impl<T: Transport, M: Mac, const MTU: usize> Sender<T, MTU, M> {
    /// The first half of [`send`](Self::send): encodes the packets. From here on [`held`](Self::held) includes this
    /// frame, which must be transmitted next.
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent.
    pub fn prepare(&mut self, positions: &[Vec3]) -> Result<PreparedFrame, SendError> {
        let ago = self.since_change(positions.iter().flat_map(Vec3::to_array));
        self.prepare_captured(positions, ago)
    }

    /// The first half of [`send_captured`](Self::send_captured).
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent.
    pub fn prepare_captured(
        &mut self,
        positions: &[Vec3],
        ago: Duration,
    ) -> Result<PreparedFrame, SendError> {
        self.prepare_frame(positions, None, ago)
    }

    /// The first half of [`send_at`](Self::send_at).
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent.
    pub fn prepare_at(
        &mut self,
        positions: &[Vec3],
        pose: RigidPose,
        ago: Duration,
    ) -> Result<PreparedFrame, SendError> {
        self.prepare_frame(positions, Some(pose), ago)
    }

    fn prepare_frame(
        &mut self,
        positions: &[Vec3],
        pose: Option<RigidPose>,
        ago: Duration,
    ) -> Result<PreparedFrame, SendError> {
        self.check()?;
        let freshness = self.freshness(ago);
        let (mut memory, mut held) = (std::mem::take(&mut self.memory), self.held.take());
        match self.make_packets(positions, (freshness, pose), &mut memory, &mut held) {
            Ok((sent, held)) => {
                let (rows, packets) = memory;
                (self.memory.0, self.held) = (rows, Some((sent.epoch, held)));
                if sent.content == Content::Whole {
                    self.since_whole = 0;
                } else {
                    self.since_whole += 1;
                }
                // A receiver refuses a frame whose age is too large for its field, so no partial frame can build on it.
                self.whole_wanted = freshness.age_ms == u16::MAX;
                self.has_pose = pose.is_some();
                Ok(PreparedFrame { sent, packets })
            }
            // Nothing was sent, so the receiver's frame is unchanged.
            Err(error) => {
                (self.memory, self.held) = (memory, held);
                Err(error)
            }
        }
    }

    /// Encodes a frame's packets in this memory. Returns it, and `held` as it is once the frame has arrived.
    fn make_packets(
        &mut self,
        positions: &[Vec3],
        (freshness, pose): (Freshness, Option<RigidPose>),
        (rows, packets): &mut (Vec<Vec3>, Packets),
        held: &mut Option<(u32, Vec<Vec3>)>,
    ) -> Result<(SentFrame, Vec<Vec3>), SendError> {
        self.surface.to_rows_in(positions, rows)?;
        let encoding = self.encoding(rows)?;
        let id = self.next_id();
        let keeps_pose = self.has_pose && pose.is_none();
        let base = held.as_ref().filter(|_| self.is_partial_wanted() && !keeps_pose);
        let frame = match base {
            Some((epoch, held)) => {
                FrameEncoder::partial(id, encoding, &rows[..], *epoch, &held[..])
            }
            None => FrameEncoder::new(id, encoding, &rows[..]),
        };
        let content = match base {
            Some(&(base_epoch, _)) => Content::Partial { base_epoch },
            None => Content::Whole,
        };
        let mac = self.mac.as_ref().ok_or(SendError::NoChallenge)?;
        let facts = self.surface.facts;
        let frame = frame.and_then(|frame| match pose {
            Some(pose) => frame.with_pose(pose),
            None => Ok(frame),
        });
        let frame = frame
            .and_then(|frame| frame.with_freshness(freshness).with_surface(facts).with_mac(mac));
        packets.fill::<_, MTU>(frame.map_err(SendError::Frame)?);

        let mut held = held.take().map_or_else(Vec::new, |(_, held)| held);
        held.resize(rows.len(), Vec3::ZERO);
        let rows = packets.iter().map(|packet| apply(packet, encoding, &mut held)).sum();
        Ok((packets.sent(id.epoch, content, rows, encoding.error()), held))
    }

    /// Encodes a modal frame: the weights of the receiver's displacement modes.
    ///
    /// # Errors
    /// [`SendError`] names the weight that cannot be sent.
    pub fn prepare_weights(&mut self, weights: &[f32]) -> Result<PreparedFrame, SendError> {
        let ago = self.since_change(weights.iter().copied());
        self.prepare_weights_captured(weights, ago)
    }

    /// The same for weights that were captured some time ago.
    ///
    /// # Errors
    /// [`SendError`] names the weight that cannot be sent.
    pub fn prepare_weights_captured(
        &mut self,
        weights: &[f32],
        ago: Duration,
    ) -> Result<PreparedFrame, SendError> {
        self.check()?;
        let freshness = self.freshness(ago);
        let id = self.next_id();
        let mac = self.mac.as_ref().ok_or(SendError::NoChallenge)?;
        let frame = WeightsEncoder::<MTU>::new(id, weights).map_err(SendError::Frame)?;
        let frame = frame.with_freshness(freshness).with_surface(self.surface.facts);
        let mut frame = frame.with_mac(mac);
        let (mut buffer, mut packets) = ([0; MTU], std::mem::take(&mut self.memory.1));
        packets.clear();
        while let Some(packet) = frame.next_packet(&mut buffer) {
            packets.push(packet);
        }
        let sent = packets.sent(id.epoch, Content::Modal, weights.len(), 0.0);
        Ok(PreparedFrame { sent, packets })
    }
}

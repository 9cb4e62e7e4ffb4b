//! The effect of each packet on the current frame.

// Requirement: B-01

use core::ops::Range;

use glam::Vec3;

use super::step::StepMeter;
use super::{Assembler, Progress, ReceiveError, arrivals};
use crate::stretch::{AdmissionCheck, FrameExtent};
use crate::surface::{PoseError, Position, RigidPose};
use crate::wire::{
    Begin, Body, Content, Encoding, Mac, Packet, PacketRows, VertexPacket, Weights, float_position,
    quantised_row,
};

impl<G: AdmissionCheck, M: Mac> Assembler<'_, G, M> {
    #[inline]
    pub(super) fn take(&mut self, packet: &Packet<'_>) -> Result<Progress, ReceiveError> {
        let epoch = packet.epoch;
        // A hello of another mesh is answered, so that its sender sees the difference.
        if let Body::Hello(hello) = packet.body {
            self.collector.hello(packet, hello, &self.mac)?;
            return Ok(Progress::Hello);
        }
        self.collector.check_mesh(packet)?;
        match packet.body {
            Body::Vertices(vertices) => self.vertices(packet, vertices),
            Body::Weights(weights) => self.weights(packet, weights),
            Body::Begin(begin) => self.begin(packet, begin),
            Body::Commit(commit) => Ok(match self.collector.commit(packet, commit, &self.mac)? {
                None => Progress::Duplicate,
                Some(is_complete) => stored(is_complete, epoch),
            }),
            Body::Heartbeat(heartbeat) => {
                self.collector.heartbeat(packet, heartbeat, &self.mac)?;
                Ok(Progress::Heartbeat)
            }
            Body::Pose(pose) => self.pose(packet, pose),
            Body::Hello(_) | Body::Status(_) => Err(ReceiveError::ForSenders),
        }
    }

    fn begin(&mut self, packet: &Packet<'_>, begin: Begin) -> Result<Progress, ReceiveError> {
        let contribution = packet.verify(&self.mac, begin.session);
        let contribution = contribution.ok_or(ReceiveError::Forged { epoch: packet.epoch })?;
        self.begin_frame(packet.epoch, begin, [packet.checksum, contribution])
    }

    /// Starts a frame whose begin is genuine, with the begin's checksum and its contribution to the digest.
    #[inline]
    pub(super) fn begin_frame(
        &mut self,
        epoch: u32,
        begin: Begin,
        sums: [u32; 2],
    ) -> Result<Progress, ReceiveError> {
        // An admitted frame that waits for a reader would block this one: try to publish it first.
        if self.is_admitted {
            self.publish();
        }
        let takes_weights = self.admission_check.weight_range(0).is_some();
        let takes_poses = self.admission_check.takes_poses();
        let here = self.surface_facts();
        let check_begin = |begin: &Begin| {
            if begin.rows != self.writer.len() {
                Err(ReceiveError::RowCount { rows: begin.rows })
            } else if (begin.content == Content::Modal) != takes_weights
                || begin.is_posed && !takes_poses
            {
                Err(ReceiveError::Encoding)
            } else if !here.agrees_with(&begin.surface) {
                Err(ReceiveError::OtherSurface { sent: begin.surface, here })
            } else {
                Ok(())
            }
        };
        let is_partial = matches!(begin.content, Content::Partial { .. });
        // Even if this frame is refused, the published rows must be copied for the next one.
        self.takes_partial |= is_partial;
        let begun = self.collector.begin::<M>(epoch, begin, sums, check_begin)?;
        let Some(frame) = begun else { return Ok(Progress::Duplicate) };
        self.is_admitted = false;
        self.clean();
        self.is_box_inside = match begin.encoding {
            Encoding::Float => false,
            Encoding::Quantised(grid) => {
                let corners = [grid.origin(), grid.upper_corner()];
                corners.into_iter().all(|corner| is_within(corner, self.max_coordinate))
            }
        };
        self.step = StepMeter::new();
        self.admission_check.begin(if is_partial {
            FrameExtent::Partial
        } else {
            FrameExtent::Whole
        });
        Ok(Progress::Begun { epoch: frame.id.epoch })
    }

    /// Takes the pose of a frame: it has a sequence number but no rows, so that no posed frame is published without it.
    #[cold]
    #[inline(never)]
    fn pose(
        &mut self,
        packet: &Packet<'_>,
        pose: Result<RigidPose, PoseError>,
    ) -> Result<Progress, ReceiveError> {
        let (frame, contribution) = self.collector.frame_of(packet, &self.mac)?;
        if !frame.begin.is_posed {
            return Err(ReceiveError::Encoding);
        }
        let Some(at) = frame.locate(packet.sequence, 0..0)? else {
            return Ok(Progress::Duplicate);
        };
        self.admission_check.place(pose.map_err(ReceiveError::Pose)?);
        Ok(stored(self.collector.take_rows(contribution, at)?, packet.epoch))
    }

    #[inline]
    fn vertices(
        &mut self,
        packet: &Packet<'_>,
        VertexPacket { first, rows }: VertexPacket<'_>,
    ) -> Result<Progress, ReceiveError> {
        let (frame, contribution) = self.collector.frame_of(packet, &self.mac)?;
        let count = rows.len() as u32;
        let out_of_range = ReceiveError::OutOfRange { first, count };
        let range = first..first.checked_add(count).ok_or(out_of_range)?;
        let limit = self.max_coordinate;
        let grid = match (&rows, frame.begin.encoding, frame.begin.content) {
            (_, _, Content::Modal) => return Err(ReceiveError::Encoding),
            (PacketRows::Float(_), Encoding::Float, _) => None,
            (PacketRows::Quantised(_), Encoding::Quantised(grid), _) => Some(grid),
            _ => return Err(ReceiveError::Encoding),
        };
        let slots = self.writer.rows(range.clone()).ok_or(out_of_range)?;
        let Some(at) = frame.locate(packet.sequence, range.clone())? else {
            return Ok(Progress::Duplicate);
        };
        let is_partial = matches!(frame.begin.content, Content::Partial { .. });
        if is_partial && range.end > self.copied {
            self.collector.want_whole();
            return Err(ReceiveError::NotReady { first });
        }
        match (rows, grid) {
            (PacketRows::Quantised(rows), Some(grid)) => {
                let decode = |row: &[u8; 6]| grid.position(quantised_row(row));
                if !self.is_box_inside {
                    check(rows.iter().map(decode), first, limit)?;
                }
                store(slots, rows, decode);
            }
            (PacketRows::Float(rows), _) => {
                check(rows.iter().map(float_position), first, limit)?;
                for (slot, row) in slots.iter().zip(rows) {
                    slot.set(float_position(row));
                }
            }
            _ => return Err(ReceiveError::Encoding),
        }
        self.stored(packet.epoch, contribution, at, range)
    }

    fn weights(
        &mut self,
        packet: &Packet<'_>,
        Weights { first, values }: Weights<'_>,
    ) -> Result<Progress, ReceiveError> {
        let (frame, contribution) = self.collector.frame_of(packet, &self.mac)?;
        let count = values.len() as u32;
        let out_of_range = ReceiveError::OutOfRange { first, count };
        let range = first..first.checked_add(count).ok_or(out_of_range)?;
        if frame.begin.content != Content::Modal {
            return Err(ReceiveError::Encoding);
        }
        let slots = self.writer.rows(range.clone()).ok_or(out_of_range)?;
        let Some(at) = frame.locate(packet.sequence, range.clone())? else {
            return Ok(Progress::Duplicate);
        };
        for (row, value) in range.clone().zip(values) {
            self.check_weight(row, f32::from_le_bytes(*value))?;
        }
        for (slot, value) in slots.iter().zip(values) {
            slot.set(Vec3::new(f32::from_le_bytes(*value), 0.0, 0.0));
        }
        self.stored(packet.epoch, contribution, at, range)
    }

    /// Whether a weight is in its mode's range.
    #[inline]
    pub(super) fn check_weight(&self, row: u32, weight: f32) -> Result<(), ReceiveError> {
        let out_of_range = ReceiveError::OutOfRange { first: row, count: 1 };
        let [low, high] = self.admission_check.weight_range(row).ok_or(out_of_range)?;
        if !weight.is_finite() {
            return Err(ReceiveError::NotFinite { row });
        }
        if low <= weight && weight <= high { Ok(()) } else { Err(ReceiveError::TooFar { row }) }
    }

    /// Notes rows that have been stored.
    #[inline]
    pub(super) fn stored(
        &mut self,
        epoch: u32,
        contribution: u32,
        at: arrivals::PacketPosition,
        rows: Range<u32>,
    ) -> Result<Progress, ReceiveError> {
        self.is_dirty = true;
        self.admission_check.moved(rows);
        Ok(stored(self.collector.take_rows(contribution, at)?, epoch))
    }
}

/// Stores rows in their slots. (On the board not inlined, so that the loop has enough registers.)
#[cfg_attr(target_arch = "arm", inline(never))]
#[cfg_attr(not(target_arch = "arm"), inline(always))]
fn store<R>(slots: &[Position], rows: &[R], decode: impl Fn(&R) -> Vec3) {
    for (slot, row) in slots.iter().zip(rows) {
        slot.set(decode(row));
    }
}

const fn stored(is_complete: bool, epoch: u32) -> Progress {
    if is_complete { Progress::Complete { epoch } } else { Progress::Stored }
}

/// Whether every coordinate is within the limit; false for NaN.
#[inline(always)]
fn is_within(position: Vec3, limit: f32) -> bool {
    let Vec3 { x, y, z } = position.abs();
    // `&`, not `&&`: three comparisons cost less than branches.
    (x <= limit) & (y <= limit) & (z <= limit)
}

/// The error for the first position that is not finite or beyond the limit.
#[inline]
pub(super) fn check(
    positions: impl Iterator<Item = Vec3> + Clone,
    first: u32,
    limit: f32,
) -> Result<(), ReceiveError> {
    let all = positions.clone().fold(true, |all, position| all & is_within(position, limit));
    if all {
        return Ok(());
    }
    let beyond = (first..).zip(positions).find(|(_, position)| !is_within(*position, limit));
    beyond.map_or(Ok(()), |(row, position)| match position.is_finite() {
        true => Err(ReceiveError::TooFar { row }),
        false => Err(ReceiveError::NotFinite { row }),
    })
}

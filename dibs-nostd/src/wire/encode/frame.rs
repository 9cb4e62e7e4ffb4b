//! A frame of vertices as packets.

use super::{PacketWriter, begin_packet, capacity};
use crate::tree::SurfaceFacts;
use crate::wire::{
    Begin, Content, EncodeError, Encoding, FrameId, Freshness, HEADER_BYTES, MAX_CONTENT_PACKETS,
    MAX_ROWS, Mac, NoMac, kind,
};
use crate::{RigidPose, VertexTable};

/// Splits one frame into packets of at most `MTU` bytes: begin, a pose if the frame has [one](Self::with_pose),
/// vertices, commit.
///
/// `MTU` is 64 for CAN-FD, up to [`MAX_PACKET`](crate::wire::MAX_PACKET) elsewhere; less than 64 does not compile. It
/// needs no memory but the caller's buffer.
///
/// ```
/// use dibs_nostd::{wire::{Encoding, FrameEncoder, FrameId, Packet}, glam::Vec3};
///
/// let positions = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
/// let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch: 1 };
/// let mut buffer = [0; 64];
/// let mut frame = FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..])?;
/// let mut packets = 0;
/// while let Some(packet) = frame.next_packet(&mut buffer) {
///     assert!(Packet::decode(packet).is_ok());
///     packets += 1;
/// }
/// assert_eq!(packets, 4); // begin, three vertices, the fourth vertex, commit
///
/// // One vertex moves: the next frame holds only that.
/// let mut moved = positions;
/// moved[2].z = 1.5;
/// let id = FrameId { epoch: 2, ..id };
/// let mut frame =
///     FrameEncoder::<_, 64>::partial(id, Encoding::Float, &moved[..], 1, &positions[..])?;
/// let mut packets = 0;
/// while frame.next_packet(&mut buffer).is_some() {
///     packets += 1;
/// }
/// assert_eq!(packets, 3);
/// # Ok::<(), dibs_nostd::wire::EncodeError>(())
/// ```
#[derive(Debug)]
pub struct FrameEncoder<'a, T: ?Sized, const MTU: usize, M = NoMac> {
    id: FrameId,
    begin: Begin,
    positions: &'a T,
    /// For a partial frame, the receiver's positions.
    held: Option<&'a T>,
    pose: Option<RigidPose>,
    mac: M,
    next: NextPacket,
    sequence: u16,
    digest: u32,
}

#[derive(Debug)]
enum NextPacket {
    Begin,
    Pose(RigidPose),
    Vertices { first: u32 },
    Commit,
    Done,
}

impl<'a, T: VertexTable + ?Sized, const MTU: usize> FrameEncoder<'a, T, MTU> {
    /// A whole frame. Checks that it can be sent. Cost: linear in the vertices.
    ///
    /// # Errors
    /// [`EncodeError`] names the first vertex that is not finite or outside the quantisation box.
    pub fn new(id: FrameId, encoding: Encoding, positions: &'a T) -> Result<Self, EncodeError> {
        let rows = u32::try_from(positions.len()).ok().filter(|rows| (1..=MAX_ROWS).contains(rows));
        let rows = rows.ok_or(EncodeError::Rows { rows: positions.len() })?;
        for row in 0..rows {
            let position = positions.position(row).filter(|position| position.is_finite());
            let position = position.ok_or(EncodeError::NotFinite { row })?;
            if let Encoding::Quantised(grid) = encoding
                && grid.quantise(position).is_none()
            {
                return Err(EncodeError::OutOfBox { row });
            }
        }
        let (session, freshness) = (id.session, Freshness::default());
        let (content, surface) = (Content::Whole, SurfaceFacts::default());
        let begin = Begin { session, content, encoding, rows, surface, freshness, is_posed: false };
        let (held, pose, next) = (None, None, NextPacket::Begin);
        let frame =
            Self { id, begin, positions, held, pose, mac: NoMac, next, sequence: 0, digest: 0 };
        frame.fits()
    }

    /// A partial frame: the vertices farther than the encoding's error from `held`, the receiver's positions in the
    /// frame `base_epoch` of the same session. It includes a few others in between if that saves packets.
    ///
    /// `held` must be the positions that the receiver decoded, not those before quantisation.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`EncodeError::Base`] or [`EncodeError::BaseEpoch`].
    pub fn partial(
        id: FrameId,
        encoding: Encoding,
        positions: &'a T,
        base_epoch: u32,
        held: &'a T,
    ) -> Result<Self, EncodeError> {
        if held.len() != positions.len() {
            return Err(EncodeError::Base { rows: held.len() });
        }
        if !(1..=u32::from(u16::MAX)).contains(&id.epoch.wrapping_sub(base_epoch)) {
            return Err(EncodeError::BaseEpoch { epoch: base_epoch });
        }
        let mut frame = Self::new(id, encoding, positions)?;
        frame.begin.content = Content::Partial { base_epoch };
        frame.held = Some(held);
        Ok(frame)
    }

    /// The same frame, with this freshness.
    #[must_use]
    pub fn with_freshness(mut self, freshness: Freshness) -> Self {
        self.begin.freshness = freshness;
        self
    }

    /// The same frame, of a surface with this unit and number of triangles.
    #[must_use]
    pub fn with_surface(mut self, surface: SurfaceFacts) -> Self {
        self.begin.surface = surface;
        self
    }

    /// The same frame with a pose, for a receiver of [`PosedRows`](crate::guard::PosedRows): positions are in mesh
    /// coordinates. A partial frame without a pose keeps that of its base; a whole frame without one is in the
    /// coordinates of the mesh's file.
    ///
    /// # Errors
    /// [`EncodeError::Packets`], because the pose takes a packet.
    pub fn with_pose(mut self, pose: RigidPose) -> Result<Self, EncodeError> {
        self.begin.is_posed = true;
        self.pose = Some(pose);
        self.fits()
    }

    /// The same frame, with a tag on every packet.
    ///
    /// # Errors
    /// [`EncodeError::Packets`], because fewer vertices fit a packet.
    pub fn with_mac<M: Mac>(self, mac: M) -> Result<FrameEncoder<'a, T, MTU, M>, EncodeError> {
        let Self { id, begin, positions, held, pose, next, sequence, digest, .. } = self;
        FrameEncoder { id, begin, positions, held, pose, mac, next, sequence, digest }.fits()
    }
}

impl<T: VertexTable + ?Sized, M: Mac, const MTU: usize> FrameEncoder<'_, T, MTU, M> {
    /// Vertices in a packet of `f32` positions.
    const FLOATS: u32 = capacity::<M>(MTU, HEADER_BYTES, 12);
    /// Vertices in a packet of quantised positions.
    const QUANTISED: u32 = capacity::<M>(MTU, HEADER_BYTES, 6);

    /// Vertices in a full packet.
    const fn capacity(&self) -> u32 {
        match self.begin.encoding {
            Encoding::Float => Self::FLOATS,
            Encoding::Quantised(_) => Self::QUANTISED,
        }
    }

    /// A partial frame never takes more packets than a whole one: each packet starts at a moved vertex, and takes all
    /// that fit after it.
    fn fits(self) -> Result<Self, EncodeError> {
        let packets = self.begin.rows.div_ceil(self.capacity()) + u32::from(self.pose.is_some());
        if packets > MAX_CONTENT_PACKETS { Err(EncodeError::Packets { packets }) } else { Ok(self) }
    }

    /// Writes the next packet to the buffer; `None` after the commit.
    pub fn next_packet<'b>(&mut self, buffer: &'b mut [u8; MTU]) -> Option<&'b [u8]> {
        let first = match self.next {
            NextPacket::Begin => {
                let packet = begin_packet::<M>(buffer, &self.id, &self.begin);
                let (packet, contribution) = packet.finish(&self.mac, self.id.session);
                self.digest = contribution;
                self.next = self.pose.map_or_else(|| self.vertices_from(0), NextPacket::Pose);
                return Some(packet);
            }
            NextPacket::Pose(pose) => {
                self.sequence = self.sequence.wrapping_add(1);
                let mut packet = self.packet(buffer, kind::POSE, 0, 0);
                for number in pose.rotation().to_array().iter().chain(&pose.shift().to_array()) {
                    packet.put(&number.to_le_bytes());
                }
                let (packet, contribution) = packet.finish(&self.mac, self.id.session);
                self.digest = self.digest.wrapping_add(contribution);
                self.next = self.vertices_from(0);
                return Some(packet);
            }
            NextPacket::Vertices { first } => first,
            NextPacket::Commit => {
                self.sequence = self.sequence.wrapping_add(1);
                let mut packet = self.packet(buffer, kind::COMMIT, 0, 0);
                packet.put(&self.digest.to_le_bytes());
                self.next = NextPacket::Done;
                return Some(packet.finish(&self.mac, self.id.session).0);
            }
            NextPacket::Done => return None,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let end = self.end_of_run(first);
        let count = (end - first) as u8;
        let kind = match self.begin.encoding {
            Encoding::Float => kind::FLOAT_VERTICES,
            Encoding::Quantised(_) => kind::QUANTISED_VERTICES,
        };
        let mut packet = self.packet(buffer, kind, count, first);
        for row in first..end {
            let position = self.positions.position(row).unwrap_or_default();
            match self.begin.encoding {
                Encoding::Float => {
                    for coordinate in position.to_array() {
                        packet.put(&coordinate.to_le_bytes());
                    }
                }
                Encoding::Quantised(grid) => {
                    for coordinate in grid.quantise(position).unwrap_or_default() {
                        packet.put(&coordinate.to_le_bytes());
                    }
                }
            }
        }
        let (packet, contribution) = packet.finish(&self.mac, self.id.session);
        self.digest = self.digest.wrapping_add(contribution);
        self.next = self.vertices_from(end);
        Some(packet)
    }

    fn packet<'b>(
        &self,
        buffer: &'b mut [u8; MTU],
        kind: u8,
        count: u8,
        first: u32,
    ) -> PacketWriter<'b, M> {
        PacketWriter::new(buffer, kind, &self.id, self.sequence, count, first)
    }

    /// The next packet: vertices from the first row at or after this one that must be sent, or the commit.
    fn vertices_from(&self, row: u32) -> NextPacket {
        match (row..self.begin.rows).find(|&row| self.must_be_sent(row)) {
            Some(first) => NextPacket::Vertices { first },
            None => NextPacket::Commit,
        }
    }

    /// One past the last row that must be sent and fits a packet that starts at `first`.
    fn end_of_run(&self, first: u32) -> u32 {
        let limit = self.begin.rows.min(first.saturating_add(self.capacity()));
        let last = (first..limit).rev().find(|&row| self.must_be_sent(row));
        last.map_or(limit, |last| last + 1)
    }

    fn must_be_sent(&self, row: u32) -> bool {
        let Some(held) = self.held else { return true };
        let (now, held) = (self.positions.position(row), held.position(row));
        let (Some(now), Some(held)) = (now, held) else { return true };
        // Written so that NaN is sent. The limit is reduced by the rounding of the difference.
        let limit = self.begin.encoding.error() * (1.0 - 4.0 * f32::EPSILON);
        !(now == held || (now - held).length() <= limit)
    }
}

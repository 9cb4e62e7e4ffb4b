//! The contents of packets.

use glam::Vec3;

use super::{QuantisedBox, StatusReport};
use crate::surface::{PoseError, RigidPose};
use crate::tree::SurfaceFacts;

/// The contents of a packet.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Body<'a> {
    /// A frame begins.
    Begin(Begin),
    /// Some of its vertices.
    Vertices(VertexPacket<'a>),
    /// Some of its mode weights.
    Weights(Weights<'a>),
    /// A frame ends: all of it was sent.
    Commit(Commit),
    /// The pose of a frame's surface.
    Pose(Result<RigidPose, PoseError>),
    /// A sign of life from the sender.
    Heartbeat(Heartbeat),
    /// The receiver's state, with its counters or as the answer to a hello: the only packet from receiver to sender.
    Status(StatusReport<'a>),
    /// The sender's request for a status.
    Hello(Hello),
}

/// The first packet of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Begin {
    /// The sender's session, all 32 bits.
    pub session: u32,
    /// The contents of the frame.
    pub content: Content,
    /// The encoding of its positions.
    pub encoding: Encoding,
    /// Vertices of the surface; in a modal frame, weights.
    pub rows: u32,
    /// The sender's surface.
    pub surface: SurfaceFacts,
    /// The frame's freshness when this packet was made.
    pub freshness: Freshness,
    /// The frame comes with a pose.
    pub is_posed: bool,
}

/// The freshness of a frame when its sender made the begin packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Freshness {
    /// Time since the surface was captured, in ms; 65,535 stands for that or more.
    pub age_ms: u16,
    /// [`Status::clock`](super::Status::clock) of the newest status received by the sender; `None` before the first.
    /// The packet was made after that status, so the receiver's clock alone bounds the transit time of both.
    pub echo: Option<u32>,
}

/// The contents of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Content {
    /// Every vertex.
    Whole,
    /// The vertices that moved by more than the encoding's error since a published frame.
    Partial {
        /// That frame, of the same session.
        base_epoch: u32,
    },
    /// The weights of displacement modes.
    Modal,
}

/// The encoding of a frame's positions.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Encoding {
    /// Three `f32` in mm: 12 bytes a vertex, exact.
    Float,
    /// Three `u16` in a box: 6 bytes a vertex.
    Quantised(QuantisedBox),
}

impl Encoding {
    /// Largest distance of a decoded position from the sender's, in mm.
    #[must_use]
    pub fn error(&self) -> f32 {
        match self {
            Self::Float => 0.0,
            Self::Quantised(grid) => grid.error(),
        }
    }
}

/// A range of consecutive vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexPacket<'a> {
    /// Row of the first vertex, in the tree's vertex order.
    pub first: u32,
    /// The positions.
    pub rows: PacketRows<'a>,
}

/// Undecoded positions, 1 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PacketRows<'a> {
    /// Little-endian `f32`, not checked: any bits are possible.
    Float(&'a [[u8; 12]]),
    /// Little-endian `u16`.
    Quantised(&'a [[u8; 6]]),
}

impl PacketRows<'_> {
    /// Number of positions.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Float(rows) => rows.len(),
            Self::Quantised(rows) => rows.len(),
        }
    }

    /// Never true for a decoded packet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Decodes one row of [`PacketRows::Float`].
#[inline(always)]
pub(crate) fn float_position(row: &[u8; 12]) -> Vec3 {
    let &[x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3] = row;
    Vec3::new(
        f32::from_le_bytes([x0, x1, x2, x3]),
        f32::from_le_bytes([y0, y1, y2, y3]),
        f32::from_le_bytes([z0, z1, z2, z3]),
    )
}

/// Decodes one row of [`PacketRows::Quantised`].
#[inline(always)]
pub(crate) const fn quantised_row(row: &[u8; 6]) -> [u16; 3] {
    let &[x0, x1, y0, y1, z0, z1] = row;
    [u16::from_le_bytes([x0, x1]), u16::from_le_bytes([y0, y1]), u16::from_le_bytes([z0, z1])]
}

/// A range of consecutive mode weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights<'a> {
    /// Number of the first mode.
    pub first: u32,
    /// Little-endian `f32`, 1 to 64 of them, not checked: any bits are possible.
    pub values: &'a [[u8; 4]],
}

/// The last packet of a frame. Its sequence number is one more than that of the frame's last packet
/// of content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Commit {
    /// Wrapping sum over the frame's begin packet and all its packets of content: of their
    /// [`Code::contribution`](super::Code::contribution) if tagged, else of their scrambled checksums. It detects a
    /// mixture of two frames with the same session and epoch.
    pub digest: u32,
}

/// A sign of life from the sender; the packet's epoch is the newest that it has begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heartbeat {
    /// The sender's session, all 32 bits.
    pub session: u32,
    /// Incremented in each heartbeat of the session; wraps.
    pub beat: u32,
    /// [`Status::clock`](super::Status::clock) of the newest status received by the sender; `None` before the first.
    pub echo: Option<u32>,
}

/// The sender's request for an answer. With a key its tag uses the challenge 0, because the sender may not know the
/// receiver's yet: so nobody without the key can collect answers to chosen nonces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// The sender's session, all 32 bits.
    pub session: u32,
    /// A random number that the answer repeats; a recorded answer cannot repeat a new one.
    pub nonce: u64,
}

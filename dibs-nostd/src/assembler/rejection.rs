//! Why something was not published, and how often.

use core::fmt;

use crate::StretchError;
use crate::wire::PacketError;

/// Why a packet, or the frame that it would have finished, was rejected. The frame published last
/// stays.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rejection {
    /// Not a packet, or damaged.
    Packet(PacketError),
    /// Vertices of another mesh.
    WrongMesh {
        /// The mesh id in the packet.
        mesh_id: u32,
    },
    /// The epoch is not newer than the published frame's, or older than that of the frame in work.
    Stale {
        /// The packet's epoch.
        epoch: u32,
    },
    /// Vertices or a commit of a frame whose begin never came, or that was abandoned.
    Unexpected {
        /// The packet's epoch.
        epoch: u32,
    },
    /// The frame has another number of vertices than this receiver.
    VertexCount {
        /// Vertices that the begin packet announces.
        vertices: u32,
    },
    /// Vertices in another encoding than the begin packet announced.
    OtherEncoding,
    /// Vertices outside the surface.
    OutOfRange {
        /// The first vertex of the packet.
        first: u32,
        /// Vertices in the packet.
        count: u32,
    },
    /// The packet has some vertices that came before and some that did not: the sender cut the frame
    /// in two ways.
    Overlap {
        /// The first vertex of the packet.
        first: u32,
    },
    /// A coordinate is infinite or not a number.
    NotFinite {
        /// The first such vertex.
        vertex: u32,
    },
    /// A coordinate is larger than this receiver allows.
    TooFar {
        /// The first such vertex, 0 for a quantisation box that reaches too far.
        vertex: u32,
    },
    /// The packets are not all of the frame that the commit confirms. The frame is abandoned.
    Digest {
        /// In the commit.
        stated: u32,
        /// Of the packets that came.
        computed: u32,
    },
    /// The gate refused the surface. The frame is abandoned.
    Stretch(StretchError),
}

impl From<PacketError> for Rejection {
    fn from(error: PacketError) -> Self {
        Self::Packet(error)
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Packet(error) => error.fmt(f),
            Self::WrongMesh { mesh_id } => write!(f, "the packet is of mesh {mesh_id:#010x}"),
            Self::Stale { epoch } => write!(f, "frame {epoch} is not newer than what is here"),
            Self::Unexpected { epoch } => write!(f, "frame {epoch} is not being received"),
            Self::VertexCount { vertices } => write!(f, "the frame has {vertices} vertices"),
            Self::OtherEncoding => write!(f, "the positions are not in the frame's encoding"),
            Self::OutOfRange { first, count } => {
                write!(f, "{count} vertices from {first} are outside the surface")
            }
            Self::Overlap { first } => {
                write!(f, "the vertices from {first} overlap with those of another packet")
            }
            Self::NotFinite { vertex } => write!(f, "vertex {vertex} is not finite"),
            Self::TooFar { vertex } => write!(f, "vertex {vertex} is too far out"),
            Self::Digest { stated, computed } => {
                write!(
                    f,
                    "the commit states digest {stated:#010x}, the packets have {computed:#010x}"
                )
            }
            Self::Stretch(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Rejection {}

/// What has happened since start: one counter a cause, each stops at its largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Counters {
    /// Frames published.
    pub published: u32,
    /// Frames given up because another began first.
    pub abandoned: u32,
    /// Packets that had come before.
    pub duplicates: u32,
    /// Packets with a wrong checksum, or too short for one.
    pub damaged: u32,
    /// Packets of another protocol version.
    pub version: u32,
    /// Packets whose checksum is right and whose form is not: the sender is at fault.
    pub malformed: u32,
    /// [`Rejection::WrongMesh`].
    pub wrong_mesh: u32,
    /// [`Rejection::Stale`].
    pub stale: u32,
    /// [`Rejection::Unexpected`].
    pub unexpected: u32,
    /// [`Rejection::VertexCount`].
    pub vertex_count: u32,
    /// [`Rejection::OtherEncoding`].
    pub other_encoding: u32,
    /// [`Rejection::OutOfRange`].
    pub out_of_range: u32,
    /// [`Rejection::Overlap`].
    pub overlap: u32,
    /// [`Rejection::NotFinite`].
    pub not_finite: u32,
    /// [`Rejection::TooFar`].
    pub too_far: u32,
    /// [`Rejection::Digest`].
    pub digest: u32,
    /// [`Rejection::Stretch`].
    pub stretch: u32,
}

impl Counters {
    /// All rejections together.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        [
            self.damaged,
            self.version,
            self.malformed,
            self.wrong_mesh,
            self.stale,
            self.unexpected,
            self.vertex_count,
            self.other_encoding,
            self.out_of_range,
            self.overlap,
            self.not_finite,
            self.too_far,
            self.digest,
            self.stretch,
        ]
        .into_iter()
        .fold(0, u32::saturating_add)
    }

    pub(super) fn count(&mut self, rejection: &Rejection) {
        increment(match rejection {
            Rejection::Packet(PacketError::TooShort { .. } | PacketError::Checksum { .. }) => {
                &mut self.damaged
            }
            Rejection::Packet(PacketError::Version { .. }) => &mut self.version,
            Rejection::Packet(_) => &mut self.malformed,
            Rejection::WrongMesh { .. } => &mut self.wrong_mesh,
            Rejection::Stale { .. } => &mut self.stale,
            Rejection::Unexpected { .. } => &mut self.unexpected,
            Rejection::VertexCount { .. } => &mut self.vertex_count,
            Rejection::OtherEncoding => &mut self.other_encoding,
            Rejection::OutOfRange { .. } => &mut self.out_of_range,
            Rejection::Overlap { .. } => &mut self.overlap,
            Rejection::NotFinite { .. } => &mut self.not_finite,
            Rejection::TooFar { .. } => &mut self.too_far,
            Rejection::Digest { .. } => &mut self.digest,
            Rejection::Stretch(_) => &mut self.stretch,
        });
    }
}

pub(super) fn increment(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

//! Why a packet or frame was rejected.

// Requirement: B-02

use core::fmt;

use crate::StretchError;
use crate::surface::{Millis, PoseError};
use crate::tree::SurfaceFacts;
use crate::wire::{Event, PacketError};

/// Why a packet, or the frame that it would have finished, was rejected. The frame published last
/// stays.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ReceiveError {
    /// Not a packet, or damaged.
    Packet(PacketError),
    /// A packet of another mesh.
    WrongMesh {
        /// The mesh id in the packet.
        mesh_id: u32,
    },
    /// A frame of a surface with another unit or size, though of the same mesh id.
    OtherSurface {
        /// The sender's surface.
        sent: SurfaceFacts,
        /// This receiver's.
        here: SurfaceFacts,
    },
    /// The tag is wrong, or missing where one is required.
    Forged {
        /// The packet's epoch.
        epoch: u32,
    },
    /// The frame is not later than the published one, or earlier than the one in work; or the heartbeat is not later
    /// than the last.
    Stale {
        /// The packet's epoch.
        epoch: u32,
    },
    /// The surface was captured before the published one, by more than the jitter of a clock.
    Earlier {
        /// By so long.
        by: Millis,
    },
    /// The surface was 65,535 ms old or older when it was sent: how old, the packet cannot say. So is one of this process
    /// that was captured in the future.
    TooOld,
    /// Rows or a commit of a frame whose begin never came, or that was abandoned.
    Unexpected {
        /// The packet's epoch.
        epoch: u32,
    },
    /// Rows or a commit of a frame that was refused before.
    Refused {
        /// The packet's epoch.
        epoch: u32,
        /// The event by which its begin, or the frame, was refused.
        cause: Event,
    },
    /// As unexpected, and the tag cannot be verified, because nothing of the packet's session has come.
    Unverifiable {
        /// The packet's epoch.
        epoch: u32,
        /// The event by which the frame's begin was refused, if one came.
        cause: Option<Event>,
    },
    /// A hello without a tag, so soon after another that it is not answered at once. The next status answers the last one.
    Throttled {
        /// Time since the hello that was taken.
        after: Millis,
    },
    /// A packet for senders.
    ForSenders,
    /// The previous frame is complete and still being checked.
    Busy {
        /// The packet's epoch.
        epoch: u32,
    },
    /// A partial frame on another base than the published frame.
    Base {
        /// The base that it changes.
        epoch: u32,
    },
    /// Rows of a partial frame came before the published frame's rows were copied.
    NotReady {
        /// The first row of the packet.
        first: u32,
    },
    /// The frame has another number of rows than this receiver.
    RowCount {
        /// Rows that the begin packet announces, or that the frame came to.
        rows: u32,
    },
    /// A frame with a content that this receiver does not take, a pose among them, rows in another encoding than their
    /// frame's, or a pose of a frame without.
    Encoding,
    /// Rows outside the surface.
    OutOfRange {
        /// The first row of the packet.
        first: u32,
        /// Rows in the packet.
        count: u32,
    },
    /// Rows out of the order of their sequence numbers, or a sequence number beyond the commit's.
    Order {
        /// The packet's sequence number.
        sequence: u16,
    },
    /// More gaps in the sequence than the receiver can note.
    Gaps {
        /// The packet's sequence number.
        sequence: u16,
    },
    /// A coordinate or weight is infinite or not a number.
    NotFinite {
        /// The first such row.
        row: u32,
    },
    /// A coordinate or weight is larger than this receiver allows.
    TooFar {
        /// The first such row.
        row: u32,
    },
    /// The packets do not add up to the commit's digest. The frame is abandoned.
    Digest {
        /// In the commit.
        stated: u32,
        /// Of the packets that came.
        computed: u32,
    },
    /// The frame's rotation and shift are no rigid pose.
    Pose(PoseError),
    /// The gate refused the surface. The frame is abandoned.
    Stretch(StretchError),
}

impl ReceiveError {
    /// Whether a frame that had begun ends with this rejection.
    pub(super) const fn ends_frame(&self) -> bool {
        matches!(self, Self::RowCount { .. } | Self::Digest { .. } | Self::Stretch(_))
    }

    /// The event that counts it.
    #[must_use]
    pub const fn event(&self) -> Event {
        match self {
            Self::Packet(PacketError::TooShort { .. } | PacketError::Checksum { .. }) => {
                Event::Damaged
            }
            Self::Packet(PacketError::Version { .. }) => Event::Version,
            Self::Packet(_) | Self::Pose(PoseError::NoRotation { .. }) => Event::Malformed,
            Self::WrongMesh { .. } | Self::OtherSurface { .. } => Event::WrongMesh,
            Self::Forged { .. } => Event::Forged,
            Self::Stale { .. } | Self::Earlier { .. } | Self::TooOld => Event::Stale,
            Self::Unexpected { .. }
            | Self::Refused { .. }
            | Self::Unverifiable { .. }
            | Self::ForSenders => Event::Unexpected,
            Self::Busy { .. } => Event::Busy,
            Self::Base { .. } => Event::Base,
            Self::NotReady { .. } => Event::NotReady,
            Self::RowCount { .. } => Event::RowCount,
            Self::Encoding => Event::Encoding,
            Self::OutOfRange { .. } => Event::OutOfRange,
            Self::Order { .. } => Event::Order,
            Self::Gaps { .. } => Event::Gaps,
            Self::NotFinite { .. } | Self::Pose(PoseError::NotFinite) => Event::NotFinite,
            Self::TooFar { .. } | Self::Pose(PoseError::TooFar { .. }) => Event::TooFar,
            Self::Digest { .. } => Event::Digest,
            Self::Throttled { .. } => Event::Throttled,
            Self::Stretch(StretchError::Shrunk { .. } | StretchError::ElementsShrunk { .. }) => {
                Event::Shrunk
            }
            Self::Stretch(StretchError::TooFast { .. }) => Event::TooFast,
            Self::Stretch(_) => Event::Stretch,
        }
    }
}

impl From<PacketError> for ReceiveError {
    fn from(error: PacketError) -> Self {
        Self::Packet(error)
    }
}

impl fmt::Display for ReceiveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Packet(error) => error.fmt(f),
            Self::WrongMesh { mesh_id } => write!(f, "the packet is of mesh {mesh_id:#010x}"),
            Self::OtherSurface { sent, here } => {
                write!(f, "the sender's surface has {sent}; the receiver's has {here}")
            }
            Self::Forged { epoch } => write!(f, "a packet of frame {epoch} has no genuine tag"),
            Self::Stale { epoch } => write!(f, "frame {epoch} is not later than what is here"),
            Self::Earlier { by } => {
                write!(f, "the surface was captured {by} before the published one")
            }
            Self::TooOld => write!(
                f,
                "the surface was 65,535 ms old or older when it was sent, or captured in the future"
            ),
            Self::Unexpected { epoch } => write!(f, "frame {epoch} is not being received"),
            Self::Refused { epoch, cause } => {
                write!(f, "frame {epoch} was refused before: {cause}")
            }
            Self::Unverifiable { epoch, cause: Some(cause) } => {
                write!(f, "frame {epoch} was refused before: {cause}")
            }
            Self::Unverifiable { epoch, cause: None } => {
                write!(f, "a packet of frame {epoch} is of a session that has not begun")
            }
            Self::Throttled { after } => {
                write!(f, "a hello without a tag came {after} after the one before")
            }
            Self::ForSenders => write!(f, "a packet for senders came to a receiver"),
            Self::Busy { epoch } => {
                write!(f, "frame {epoch} began while the one before was being checked")
            }
            Self::Base { epoch } => write!(f, "frame {epoch}, to be changed, is not published"),
            Self::NotReady { first } => {
                write!(
                    f,
                    "published rows that the packet from row {first} on changes are not copied yet"
                )
            }
            Self::RowCount { rows } => write!(f, "the frame has {rows} rows"),
            Self::Encoding => write!(f, "not the content or encoding that is received here"),
            Self::OutOfRange { first, count } => {
                write!(f, "{count} rows from {first} are outside the surface")
            }
            Self::Order { sequence } => {
                write!(f, "packet {sequence} of the frame does not go with the others")
            }
            Self::Gaps { sequence } => {
                write!(f, "packet {sequence} of the frame leaves too many gaps")
            }
            Self::NotFinite { row } => write!(f, "row {row} is not finite"),
            Self::TooFar { row } => write!(f, "row {row} is too far out"),
            Self::Digest { stated, computed } => {
                write!(
                    f,
                    "the commit states digest {stated:#010x}, the packets have {computed:#010x}"
                )
            }
            Self::Pose(error) => error.fmt(f),
            Self::Stretch(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ReceiveError {}

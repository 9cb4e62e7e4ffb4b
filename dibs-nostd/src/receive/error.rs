//! Why a packet or frame was rejected.

// Requirement: B-02

use core::fmt;

use crate::StretchError;
use crate::surface::{Millis, PoseError};
use crate::tree::SurfaceFacts;
use crate::wire::{Event, PacketError};

/// Why a packet, or the frame that it would have completed, was rejected. The last published frame stays.
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
    /// A frame of a surface with another unit or size, but the same mesh id.
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
    /// The frame is not later than the published one, or earlier than the one being received; or the heartbeat is not
    /// later than the last.
    Stale {
        /// The packet's epoch.
        epoch: u32,
    },
    /// The surface was captured before the published one, by more than the jitter of a clock.
    Earlier {
        /// The time difference.
        by: Millis,
    },
    /// The surface was at least 65,535 ms old when it was sent, more than a packet can state; or a frame of this
    /// process was captured in the future.
    TooOld,
    /// Rows or a commit of a frame whose begin was not received, or that was abandoned.
    Unexpected {
        /// The packet's epoch.
        epoch: u32,
    },
    /// Rows or a commit of a frame that was refused.
    Refused {
        /// The packet's epoch.
        epoch: u32,
        /// The event by which its begin, or the frame, was refused.
        cause: Event,
    },
    /// As [`Unexpected`](Self::Unexpected); its tag cannot be verified because no begin of its session was received.
    Unverifiable {
        /// The packet's epoch.
        epoch: u32,
        /// The event by which the frame's begin was refused, if one came.
        cause: Option<Event>,
    },
    /// A hello without a tag, too soon after another to be answered at once. The next status answers the latest hello.
    Throttled {
        /// Time since the last accepted hello.
        after: Millis,
    },
    /// A packet for senders.
    ForSenders,
    /// The previous frame is complete and still being checked.
    Busy {
        /// The packet's epoch.
        epoch: u32,
    },
    /// A partial frame whose base is not the published frame.
    Base {
        /// The base that it changes.
        epoch: u32,
    },
    /// Rows of a partial frame arrived before the published frame's rows were copied.
    NotReady {
        /// The first row of the packet.
        first: u32,
    },
    /// The frame has another number of rows than this receiver.
    RowCount {
        /// Rows announced by the begin packet, or of the whole frame.
        rows: u32,
    },
    /// The content or encoding is not accepted: unknown content, a pose where none is expected, or rows in another
    /// encoding than their frame's.
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
    /// More gaps in the sequence than the receiver can track.
    Gaps {
        /// The packet's sequence number.
        sequence: u16,
    },
    /// A coordinate or weight is infinite or not a number.
    NotFinite {
        /// The first such row.
        row: u32,
    },
    /// A coordinate or weight is beyond this receiver's limit.
    TooFar {
        /// The first such row.
        row: u32,
    },
    /// The packets do not match the commit's digest. The frame is abandoned.
    Digest {
        /// In the commit.
        stated: u32,
        /// Of the received packets.
        computed: u32,
    },
    /// The frame's rotation and shift are not a rigid pose.
    Pose(PoseError),
    /// The admission check refused the surface. The frame is abandoned.
    Stretch(StretchError),
}

impl ReceiveError {
    /// Whether this rejection ends the current frame.
    pub(super) const fn ends_frame(&self) -> bool {
        matches!(self, Self::RowCount { .. } | Self::Digest { .. } | Self::Stretch(_))
    }

    /// The event that counts this rejection.
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
            Self::Stale { epoch } => write!(f, "frame {epoch} is not later than the last one"),
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
            Self::Encoding => write!(f, "the content or encoding is not accepted"),
            Self::OutOfRange { first, count } => {
                write!(f, "{count} rows from {first} are outside the surface")
            }
            Self::Order { sequence } => {
                write!(f, "packet {sequence} is out of order in its frame")
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

//! Why bytes are not a packet.

// Requirement: B-02

use core::fmt;

/// Why bytes are not a packet of this protocol. Names the first check that failed; the checksum is compared before
/// anything that it covers is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PacketError {
    /// Shorter than a header and a checksum.
    TooShort {
        /// Bytes received.
        bytes: usize,
    },
    /// The checksum does not match: the packet was damaged, or is none.
    Checksum {
        /// In the packet.
        stated: u32,
        /// Of the bytes received.
        computed: u32,
    },
    /// A version that this receiver does not support.
    Version {
        /// In the packet.
        version: u8,
    },
    /// A kind that this version does not have.
    Kind {
        /// In the packet.
        kind: u8,
    },
    /// A field that must be zero is not.
    Reserved {
        /// Offset of the field's first byte.
        offset: usize,
    },
    /// A packet outside its frame, a partial frame that changes itself, or another kind of packet in a frame.
    Sequence {
        /// In the packet.
        sequence: u16,
    },
    /// The length does not match kind and count.
    Length {
        /// Bytes received.
        bytes: usize,
        /// Bytes that a packet of this kind and count has.
        expected: usize,
    },
    /// A packet of vertices or weights without any.
    Empty,
    /// A content of frames that this version does not have.
    Content {
        /// In the packet.
        content: u8,
    },
    /// A frame without rows, or with more than a frame can have.
    Rows {
        /// In the packet.
        rows: u32,
    },
    /// An encoding that this version does not have.
    Encoding {
        /// In the packet.
        encoding: u8,
    },
    /// A unit that this version does not have.
    Unit {
        /// In the packet.
        unit: u8,
    },
    /// A quantisation box that is not finite, or whose step is not positive.
    Box,
}

impl fmt::Display for PacketError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort { bytes } => write!(f, "{bytes} bytes are too few for a packet"),
            Self::Checksum { stated, computed } => {
                write!(
                    f,
                    "the packet states checksum {stated:#010x}, its bytes have {computed:#010x}"
                )
            }
            Self::Version { version } => write!(f, "protocol version {version} is not supported"),
            Self::Kind { kind } => write!(f, "packet kind {kind} does not exist"),
            Self::Reserved { offset } => write!(f, "the field at byte {offset} must be zero"),
            Self::Sequence { sequence } => {
                write!(f, "sequence number {sequence} does not fit the packet's kind")
            }
            Self::Length { bytes, expected } => {
                write!(f, "the packet has {bytes} bytes, its kind and count require {expected}")
            }
            Self::Empty => write!(f, "a packet of vertices or weights without any"),
            Self::Content { content } => write!(f, "frame content {content} does not exist"),
            Self::Rows { rows } => write!(f, "a frame cannot have {rows} rows"),
            Self::Encoding { encoding } => write!(f, "position encoding {encoding} does not exist"),
            Self::Unit { unit } => write!(f, "unit {unit} does not exist"),
            Self::Box => write!(f, "the quantisation box is not finite or its step not positive"),
        }
    }
}

impl core::error::Error for PacketError {}

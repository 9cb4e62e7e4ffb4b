//! The wire protocol: surfaces as packets of at most one transport unit, and statuses in the other direction.
//!
//! The byte layout is specified in `docs/wire.md`. A frame is one [`Begin`] packet, [`VertexPacket`]s or packets of
//! [`Weights`], and one [`Commit`]; a pose may follow the begin. [`FrameEncoder`] and [`WeightsEncoder`] make the
//! packets on the sender's side, [`Packet::decode`] reads one in place on the receiver's, and the
//! [`Assembler`](crate::Assembler) makes frames of them. A [`Heartbeat`] is the sender's sign of life, a [`Status`]
//! reports the published frame to the sender, a [`Hello`] asks for a [`StatusAnswer`].
//!
//! On a byte stream each packet is framed with COBS: [`enframe`] and [`Deframer`]. On UDP a packet is
//! one datagram, on CAN-FD one message: [`canfd`].
//!
//! Work is bounded by the packet's length, and only positions are copied.

// Requirements: B-06, B-07

mod body;
pub mod canfd;
mod checksum;
#[cfg(feature = "authenticity")]
mod cmac;
mod counters;
mod encode;
mod error;
mod fields;
mod id;
mod mac;
mod packet;
mod quantised;
mod status;
mod stream;

#[cfg(feature = "authenticity")]
pub use self::cmac::AesCmac;
/// A packet's contents, for the senders of `dibs-stream`: a receiver passes bytes to its assembler.
#[doc(hidden)]
pub use body::{Begin, Body, Commit, Content, Heartbeat, Hello, PacketRows, VertexPacket, Weights};
pub use body::{Encoding, Freshness};
pub(crate) use body::{float_position, quantised_row};
pub use counters::{Counters, Event};
pub use encode::{
    EncodeError, FrameEncoder, WeightsEncoder, encode_heartbeat, encode_hello, encode_status,
};
pub use error::PacketError;
pub use id::FrameId;
#[doc(hidden)]
pub use id::is_newer;
#[doc(hidden)]
pub use mac::TAG_BYTES;
pub use mac::{Code, Direction, Mac, NoMac};
#[doc(hidden)]
pub use packet::Packet;
pub use quantised::{BoxError, QuantisedBox};
pub use status::Status;
#[doc(hidden)]
pub use status::{PublishedStatus, StatusAnswer, StatusReport};
#[doc(hidden)]
pub use stream::framed_bytes;
pub use stream::{Deframer, StreamError, enframe};

/// The protocol's version: the first byte of every packet.
#[doc(hidden)]
pub const VERSION: u8 = 4;

/// Bytes of the header that every packet starts with.
#[doc(hidden)]
pub const HEADER_BYTES: usize = 18;

/// Bytes of the CRC-32 that every packet ends with.
#[doc(hidden)]
pub const CHECKSUM_BYTES: usize = 4;

/// Smallest transport unit: a CAN-FD message.
#[doc(hidden)]
pub const MIN_MTU: usize = 64;

/// Largest packet: 255 `f32` positions and a tag.
pub const MAX_PACKET: usize = HEADER_BYTES + 255 * 12 + TAG_BYTES + CHECKSUM_BYTES;

/// Most rows that a frame can have.
#[doc(hidden)]
pub const MAX_ROWS: u32 = (1 << 24) - 1;

/// Most packets between a frame's begin and its commit.
#[doc(hidden)]
pub const MAX_CONTENT_PACKETS: u32 = 65_534;

/// The sequence number of a posed frame's pose.
pub(crate) const POSE_SEQUENCE: u16 = 1;

/// Most weights that a modal frame can have.
#[doc(hidden)]
pub const MAX_WEIGHTS: u32 = 64;

/// The packet kinds: the second byte. Others are reserved.
mod kind {
    pub const BEGIN: u8 = 1;
    pub const FLOAT_VERTICES: u8 = 2;
    pub const QUANTISED_VERTICES: u8 = 3;
    pub const COMMIT: u8 = 4;
    pub const WEIGHTS: u8 = 5;
    pub const HEARTBEAT: u8 = 6;
    pub const STATUS: u8 = 7;
    pub const HELLO: u8 = 8;
    /// A status that answers a hello.
    pub const ANSWER: u8 = 9;
    pub const POSE: u8 = 10;
    /// Set in the kind of a packet with a tag.
    pub const TAGGED: u8 = 0x80;
}

/// Length of a packet with this many bytes of content: up to 64 rounded up to a CAN-FD length.
const fn padded(bytes: usize) -> usize {
    match canfd::dlc_of(bytes) {
        Some(dlc) => canfd::length_of(dlc),
        None => bytes,
    }
}

//! The wire protocol: vertex frames as packets of at most one transport unit.
//!
//! The byte layout is specified in `docs/wire.md`. A frame is one [`Begin`] packet, [`Vertices`]
//! packets in any order, and one [`Commit`]. [`FrameEncoder`] makes the packets on the sender's side,
//! [`Packet::decode`] reads one in place on the receiver's, and the
//! [`Assembler`](crate::Assembler) makes frames of them. On a byte stream each packet is framed with
//! COBS: [`enframe`] and [`Deframer`]. On CAN-FD or UDP a packet is one message.
//!
//! Everything is bounded by the packet's length, and nothing is copied but positions.

mod encode;
mod error;
mod packet;
mod quantised;
mod stream;

pub use encode::{EncodeError, FrameEncoder};
pub use error::PacketError;
pub use packet::{Begin, Body, Commit, Encoding, Packet, Rows, Vertices};
pub(crate) use packet::{float_position, quantised_row};
pub use quantised::{BoxError, QuantisedBox};
pub use stream::{Deframer, StreamError, enframe, framed_bytes};

/// The protocol's version: the first byte of every packet.
pub const VERSION: u8 = 1;

/// Bytes of the header that every packet starts with.
pub const HEADER_BYTES: usize = 18;

/// Bytes of the CRC-32 that every packet ends with.
pub const CHECKSUM_BYTES: usize = 4;

/// Smallest transport unit: a CAN-FD message. A [`Begin`] packet needs 54 bytes of it.
pub const MIN_MTU: usize = 64;

/// Largest packet: 255 `f32` positions.
pub const MAX_PACKET: usize = HEADER_BYTES + 255 * 12 + CHECKSUM_BYTES;

/// The packet kinds: the second byte. Others are reserved.
mod kind {
    pub const BEGIN: u8 = 1;
    pub const FLOAT_VERTICES: u8 = 2;
    pub const QUANTISED_VERTICES: u8 = 3;
    pub const COMMIT: u8 = 4;
}

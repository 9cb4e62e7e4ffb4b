//! The protocol between the fault matrix and the receiver on the board.

/// Vertices of the surface.
pub const VERTICES: usize = 66;
/// Largest packet to the board, in bytes: so small that a frame takes several packets.
pub const MTU: usize = 128;
/// Triangles checked, or rows copied, in one slice.
pub const WORK: u32 = 64;
/// Largest status packet, in bytes: with every counter.
pub const REPORT_MTU: usize = 200;
/// Bytes of a report before its status: bytes received, frames published, epoch, digest.
pub const HEAD_BYTES: usize = 16;
/// The key of both sides.
pub const KEY: [u8; 16] = *b"sixteen bytes...";
/// The receiver's id.
pub const RECEIVER: u32 = 7;

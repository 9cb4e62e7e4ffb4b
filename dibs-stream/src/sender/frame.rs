//! One frame's packets, their effect on the receiver's table, and their count.

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Body, Content, Encoding, FrameEncoder, Mac, Packet, QuantisedBox, Rows};

/// A frame that was sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sent {
    /// Its number.
    pub epoch: u32,
    /// Whether whole, partial or modal.
    pub content: Content,
    /// Vertices, or weights, in it.
    pub rows: usize,
    /// Packets that it took.
    pub packets: usize,
    /// Bytes of the packets, without a byte stream's framing.
    pub bytes: usize,
    /// Largest distance of a vertex from its position at the receiver, in mm.
    pub error: f32,
}

/// A frame whose packets are made but not sent.
#[derive(Debug)]
pub struct Prepared {
    pub(super) sent: Sent,
    pub(super) packets: Vec<Vec<u8>>,
}

impl Prepared {
    pub(super) fn new(
        epoch: u32,
        content: Content,
        rows: usize,
        error: f32,
        packets: Vec<Vec<u8>>,
    ) -> Self {
        let bytes = packets.iter().map(Vec::len).sum();
        let sent = Sent { epoch, content, rows, packets: packets.len(), bytes, error };
        Self { sent, packets }
    }

    /// The counts once it is sent.
    #[must_use]
    pub const fn sent(&self) -> &Sent {
        &self.sent
    }
}

/// All packets of a frame.
pub(super) fn packets_of<M: Mac, const MTU: usize>(
    mut frame: FrameEncoder<'_, [Vec3], MTU, M>,
) -> Vec<Vec<u8>> {
    let mut buffer = [0; MTU];
    let mut packets = Vec::new();
    while let Some(packet) = frame.next_packet(&mut buffer) {
        packets.push(packet.to_vec());
    }
    packets
}

/// Applies the packets to the positions as the receiver will; returns their number.
pub(super) fn apply(packet: &[u8], encoding: Encoding, held: &mut [Vec3]) -> usize {
    let Ok(Packet { body: Body::Vertices(vertices), .. }) = Packet::decode(packet) else {
        return 0;
    };
    let rows = held.iter_mut().skip(vertices.first as usize);
    match (vertices.rows, encoding) {
        (Rows::Float(floats), _) => {
            for (row, bytes) in rows.zip(floats) {
                let (words, _) = bytes.as_chunks::<4>();
                *row = Vec3::from_array([0, 1, 2].map(|axis| f32::from_le_bytes(words[axis])));
            }
        }
        (Rows::Quantised(numbers), Encoding::Quantised(grid)) => {
            for (row, bytes) in rows.zip(numbers) {
                let (words, _) = bytes.as_chunks::<2>();
                *row = grid.position([0, 1, 2].map(|axis| u16::from_le_bytes(words[axis])));
            }
        }
        _ => (),
    }
    vertices.rows.len()
}

/// The box with coarser steps, so that its error is nearly `error` (mm), if it was less.
pub(super) fn coarsened(grid: QuantisedBox, error: f32) -> QuantisedBox {
    // Half a step along each of three axes, and the rounding of the 65,536 steps that the box reaches.
    let step = error * 1.119 - grid.origin().abs().max_element() * 1e-6;
    if step <= grid.step().max_element() {
        return grid;
    }
    QuantisedBox::new(grid.origin() - step, Vec3::splat(step)).unwrap_or(grid)
}

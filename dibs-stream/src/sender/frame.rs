//! One frame's packets, their effect on the receiver's table, and their counts.

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Body, Content, Encoding, FrameEncoder, Mac, Packet, PacketRows, QuantisedBox,
};

/// A frame that was sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentFrame {
    /// Its number.
    pub epoch: u32,
    /// Whether the frame is whole, partial or modal.
    pub content: Content,
    /// Number of vertices or weights in it.
    pub rows: usize,
    /// Number of its packets.
    pub packets: usize,
    /// Bytes of its packets, without the framing of a byte stream.
    pub bytes: usize,
    /// Largest distance of a vertex from its position at the receiver, in mm.
    pub error: f32,
}

/// A frame whose packets are encoded but not sent.
#[derive(Debug)]
pub struct PreparedFrame {
    pub(super) sent: SentFrame,
    pub(super) packets: Packets,
}

impl PreparedFrame {
    /// The counts that apply once it is sent.
    #[must_use]
    pub const fn sent(&self) -> &SentFrame {
        &self.sent
    }
}

/// Consecutive packets, in memory that is reused.
#[derive(Debug, Default)]
pub(super) struct Packets {
    bytes: Vec<u8>,
    /// End of each packet.
    ends: Vec<usize>,
}

impl Packets {
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.ends.clear();
    }

    pub fn push(&mut self, packet: &[u8]) {
        self.bytes.extend_from_slice(packet);
        self.ends.push(self.bytes.len());
    }

    /// Replaces the packets by those of this frame.
    pub fn fill<M: Mac, const MTU: usize>(&mut self, mut frame: FrameEncoder<'_, [Vec3], MTU, M>) {
        self.clear();
        let mut buffer = [0; MTU];
        while let Some(packet) = frame.next_packet(&mut buffer) {
            self.push(packet);
        }
    }

    /// The description of these packets once they are sent.
    pub fn sent(&self, epoch: u32, content: Content, rows: usize, error: f32) -> SentFrame {
        let (packets, bytes) = (self.ends.len(), self.bytes.len());
        SentFrame { epoch, content, rows, packets, bytes, error }
    }

    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.bytes[start..end])
    }
}

/// Applies a packet to the positions as the receiver will; returns the number of rows.
pub(super) fn apply(packet: &[u8], encoding: Encoding, held: &mut [Vec3]) -> usize {
    let Ok(Packet { body: Body::Vertices(vertices), .. }) = Packet::decode(packet) else {
        return 0;
    };
    let rows = held.iter_mut().skip(vertices.first as usize);
    match (vertices.rows, encoding) {
        (PacketRows::Float(floats), _) => {
            for (row, bytes) in rows.zip(floats) {
                let (words, _) = bytes.as_chunks::<4>();
                *row = Vec3::from_array([0, 1, 2].map(|axis| f32::from_le_bytes(words[axis])));
            }
        }
        (PacketRows::Quantised(numbers), Encoding::Quantised(grid)) => {
            for (row, bytes) in rows.zip(numbers) {
                let (words, _) = bytes.as_chunks::<2>();
                *row = grid.position([0, 1, 2].map(|axis| u16::from_le_bytes(words[axis])));
            }
        }
        _ => (),
    }
    vertices.rows.len()
}

/// The box with coarser steps, so that its error is nearly `error` (mm); unchanged if its error is larger already.
pub(super) fn coarsened(grid: QuantisedBox, error: f32) -> QuantisedBox {
    // Half a step along each of three axes, and the rounding of positions up to 65,536 steps away.
    let step = error * 1.119 - grid.origin().abs().max_element() * 1e-6;
    if step <= grid.step().max_element() {
        return grid;
    }
    QuantisedBox::new(grid.origin() - step, Vec3::splat(step)).unwrap_or(grid)
}

//! A frame as packets, for the sender.

use core::fmt;

use super::{
    CHECKSUM_BYTES, Encoding, HEADER_BYTES, MAX_PACKET, MIN_MTU, QuantisedBox, VERSION, kind,
};
use crate::VertexTable;
use crate::format::CRC;

/// Cuts one frame into packets of at most `MTU` bytes: begin, vertices, commit.
///
/// `MTU` is 64 for CAN-FD, up to [`MAX_PACKET`] elsewhere; less than 64 does not compile. No memory
/// but the caller's buffer.
///
/// ```
/// use dibs_nostd::{wire::{Encoding, FrameEncoder, Packet}, glam::Vec3};
///
/// let positions = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
/// let mut frame =
///     FrameEncoder::<_, 64>::new(0xB0D1, 1, Encoding::Float, &positions[..]).unwrap();
/// let mut buffer = [0; 64];
/// let mut packets = 0;
/// while let Some(packet) = frame.next_packet(&mut buffer) {
///     assert!(Packet::decode(packet).is_ok());
///     packets += 1;
/// }
/// assert_eq!(packets, 4); // begin, three vertices, the fourth vertex, commit
/// ```
pub struct FrameEncoder<'a, T: ?Sized, const MTU: usize> {
    mesh_id: u32,
    epoch: u32,
    encoding: Encoding,
    vertices: u32,
    positions: &'a T,
    next: Next,
    digest: u32,
}

enum Next {
    Begin,
    Vertices { first: u32 },
    Commit,
    Done,
}

impl<'a, T: VertexTable + ?Sized, const MTU: usize> FrameEncoder<'a, T, MTU> {
    /// Vertices in a packet of `f32` positions.
    const FLOATS: u32 = Self::rows(12);
    /// Vertices in a packet of quantised positions.
    const QUANTISED: u32 = Self::rows(6);

    const fn rows(size: usize) -> u32 {
        assert!(MTU >= MIN_MTU, "a packet needs a transport unit of at least 64 bytes");
        let rows = (MTU - HEADER_BYTES - CHECKSUM_BYTES) / size;
        if rows > 255 { 255 } else { rows as u32 }
    }

    /// Checks that the whole frame can be sent. Linear in the vertices.
    ///
    /// # Errors
    /// [`EncodeError`] names the first vertex that is not finite or outside the quantisation box.
    pub fn new(
        mesh_id: u32,
        epoch: u32,
        encoding: Encoding,
        positions: &'a T,
    ) -> Result<Self, EncodeError> {
        let vertices = u32::try_from(positions.len())
            .map_err(|_| EncodeError::Vertices { vertices: positions.len() })?;
        if vertices == 0 {
            return Err(EncodeError::Vertices { vertices: 0 });
        }
        for vertex in 0..vertices {
            let position = positions.position(vertex).filter(|position| position.is_finite());
            let position = position.ok_or(EncodeError::NotFinite { vertex })?;
            if let Encoding::Quantised(grid) = encoding
                && grid.quantise(position).is_none()
            {
                return Err(EncodeError::OutOfBox { vertex });
            }
        }
        Ok(Self { mesh_id, epoch, encoding, vertices, positions, next: Next::Begin, digest: 0 })
    }

    /// Writes the next packet to the buffer; `None` after the commit.
    pub fn next_packet<'b>(&mut self, buffer: &'b mut [u8; MTU]) -> Option<&'b [u8]> {
        let mut bytes = Bytes { buffer, used: 0 };
        match self.next {
            Next::Begin => {
                self.header(&mut bytes, kind::BEGIN, 0, 0);
                self.begin(&mut bytes);
                self.digest = bytes.seal();
                self.next = Next::Vertices { first: 0 };
            }
            Next::Vertices { first } => {
                let left = self.vertices - first;
                match self.encoding {
                    Encoding::Float => {
                        let count = left.min(Self::FLOATS);
                        self.header(&mut bytes, kind::FLOAT_VERTICES, count as u8, first);
                        self.floats(&mut bytes, first, count);
                    }
                    Encoding::Quantised(grid) => {
                        let count = left.min(Self::QUANTISED);
                        self.header(&mut bytes, kind::QUANTISED_VERTICES, count as u8, first);
                        self.quantised(&mut bytes, &grid, first, count);
                    }
                }
                self.digest = self.digest.wrapping_add(bytes.seal());
                self.next = match self.encoding {
                    Encoding::Float if left > Self::FLOATS => {
                        Next::Vertices { first: first + Self::FLOATS }
                    }
                    Encoding::Quantised(_) if left > Self::QUANTISED => {
                        Next::Vertices { first: first + Self::QUANTISED }
                    }
                    _ => Next::Commit,
                };
            }
            Next::Commit => {
                self.header(&mut bytes, kind::COMMIT, 0, 0);
                bytes.put(&self.digest.to_le_bytes());
                bytes.seal();
                self.next = Next::Done;
            }
            Next::Done => return None,
        }
        let Bytes { buffer, used } = bytes;
        buffer.get(..used)
    }

    fn header(&self, bytes: &mut Bytes<'_>, kind: u8, count: u8, first: u32) {
        bytes.put(&[VERSION, kind, 0, count]);
        bytes.put(&self.mesh_id.to_le_bytes());
        bytes.put(&self.epoch.to_le_bytes());
        bytes.put(&first.to_le_bytes());
        bytes.put(&[0, 0]);
    }

    fn begin(&self, bytes: &mut Bytes<'_>) {
        bytes.put(&self.vertices.to_le_bytes());
        match self.encoding {
            Encoding::Float => bytes.put(&[0; 28]),
            Encoding::Quantised(grid) => {
                bytes.put(&[1, 0, 0, 0]);
                for coordinate in grid.origin().to_array().iter().chain(&grid.step().to_array()) {
                    bytes.put(&coordinate.to_le_bytes());
                }
            }
        }
    }

    fn floats(&self, bytes: &mut Bytes<'_>, first: u32, count: u32) {
        for vertex in first..first + count {
            for coordinate in self.positions.position(vertex).unwrap_or_default().to_array() {
                bytes.put(&coordinate.to_le_bytes());
            }
        }
    }

    fn quantised(&self, bytes: &mut Bytes<'_>, grid: &QuantisedBox, first: u32, count: u32) {
        for vertex in first..first + count {
            let position = self.positions.position(vertex).unwrap_or_default();
            for coordinate in grid.quantise(position).unwrap_or_default() {
                bytes.put(&coordinate.to_le_bytes());
            }
        }
    }
}

/// Appends to a buffer that is known to be large enough: `MTU` and the row counts see to it.
struct Bytes<'b> {
    buffer: &'b mut [u8],
    used: usize,
}

impl Bytes<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let end = self.used.saturating_add(bytes.len());
        if let Some(room) = self.buffer.get_mut(self.used..end) {
            for (to, from) in room.iter_mut().zip(bytes) {
                *to = *from;
            }
            self.used = end;
        }
    }

    /// Appends the checksum, and returns it.
    fn seal(&mut self) -> u32 {
        let checksum = CRC.checksum(self.buffer.get(..self.used).unwrap_or_default());
        self.put(&checksum.to_le_bytes());
        checksum
    }
}

const _: () = assert!(MAX_PACKET >= MIN_MTU);

/// Why a frame cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// No vertex, or more than 32 bits can number.
    Vertices {
        /// How many.
        vertices: usize,
    },
    /// A position is not finite.
    NotFinite {
        /// The first such vertex.
        vertex: u32,
    },
    /// A position is outside the quantisation box.
    OutOfBox {
        /// The first such vertex.
        vertex: u32,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertices { vertices } => {
                write!(f, "a frame of {vertices} vertices cannot be sent")
            }
            Self::NotFinite { vertex } => write!(f, "vertex {vertex} is not finite"),
            Self::OutOfBox { vertex } => {
                write!(f, "vertex {vertex} is outside the quantisation box")
            }
        }
    }
}

impl core::error::Error for EncodeError {}

//! One packet, decoded in place.

use glam::Vec3;

use super::{BoxError, CHECKSUM_BYTES, HEADER_BYTES, PacketError, QuantisedBox, VERSION, kind};
use crate::format::CRC;

/// A packet whose checksum and form are right. It borrows the bytes that it was decoded from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet<'a> {
    /// Identity of the mesh whose vertices these are: `Tree::mesh_id`.
    pub mesh_id: u32,
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// The packet's CRC-32: [`Commit::digest`] sums them.
    pub checksum: u32,
    /// What the packet says.
    pub body: Body<'a>,
}

/// What a packet says.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Body<'a> {
    /// A frame begins.
    Begin(Begin),
    /// Some of its vertices.
    Vertices(Vertices<'a>),
    /// The sender has sent all of it.
    Commit(Commit),
}

/// The first packet of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Begin {
    /// Vertices of the whole frame.
    pub vertices: u32,
    /// How the frame's positions are written.
    pub encoding: Encoding,
}

/// How a frame's positions are written.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Encoding {
    /// Three `f32` in mm: 12 bytes a vertex, exact.
    Float,
    /// Three `u16` in a box: 6 bytes a vertex.
    Quantised(QuantisedBox),
}

/// A run of consecutive vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertices<'a> {
    /// Row of the first vertex, in the tree's vertex order.
    pub first: u32,
    /// The positions.
    pub rows: Rows<'a>,
}

/// Positions as they stand in the packet: 1 to 255 of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Rows<'a> {
    /// Little-endian `f32`, not checked: any bits may come.
    Float(&'a [[u8; 12]]),
    /// Little-endian `u16`.
    Quantised(&'a [[u8; 6]]),
}

impl Rows<'_> {
    /// Number of positions.
    #[must_use]
    pub const fn len(&self) -> usize {
        match self {
            Self::Float(rows) => rows.len(),
            Self::Quantised(rows) => rows.len(),
        }
    }

    /// Never true for a decoded packet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Decodes one row of [`Rows::Float`].
#[inline(always)]
pub(crate) fn float_position(row: &[u8; 12]) -> Vec3 {
    let &[x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3] = row;
    Vec3::new(
        f32::from_le_bytes([x0, x1, x2, x3]),
        f32::from_le_bytes([y0, y1, y2, y3]),
        f32::from_le_bytes([z0, z1, z2, z3]),
    )
}

/// Decodes one row of [`Rows::Quantised`].
#[inline(always)]
pub(crate) const fn quantised_row(row: &[u8; 6]) -> [u16; 3] {
    let &[x0, x1, y0, y1, z0, z1] = row;
    [u16::from_le_bytes([x0, x1]), u16::from_le_bytes([y0, y1]), u16::from_le_bytes([z0, z1])]
}

/// The last packet of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Commit {
    /// Wrapping sum of the checksums of the frame's begin packet and all its vertex packets. Packets
    /// of two frames that happen to share an epoch, as after a restart of the sender, do not add up
    /// to it.
    pub digest: u32,
}

impl<'a> Packet<'a> {
    /// Checks the checksum and the form of a packet. Cost: linear in the bytes.
    ///
    /// Whether mesh, epoch, range and coordinates make sense is for the receiver to judge.
    ///
    /// ```
    /// use dibs_nostd::wire::{Packet, PacketError};
    /// assert_eq!(Packet::decode(&[1, 2, 3]), Err(PacketError::TooShort { bytes: 3 }));
    /// ```
    ///
    /// # Errors
    /// [`PacketError`] names the first check that failed.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, PacketError> {
        let too_short = PacketError::TooShort { bytes: bytes.len() };
        let (content, stated) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(too_short)?;
        let (header, rest) = content.split_first_chunk::<HEADER_BYTES>().ok_or(too_short)?;
        let stated = u32::from_le_bytes(*stated);
        let computed = CRC.checksum(content);
        if stated != computed {
            return Err(PacketError::Checksum { stated, computed });
        }
        let &[version, kind, flags, count, m0, m1, m2, m3, e0, e1, e2, e3, f0, f1, f2, f3, r0, r1] =
            header;
        if version != VERSION {
            return Err(PacketError::Version { version });
        }
        zero(flags == 0, 2)?;
        zero(r0 == 0 && r1 == 0, 16)?;
        let first = u32::from_le_bytes([f0, f1, f2, f3]);
        let frame = FieldsOfBody { bytes: bytes.len(), first, count, rest };
        let body = match kind {
            kind::BEGIN => Body::Begin(frame.begin()?),
            kind::FLOAT_VERTICES => {
                Body::Vertices(Vertices { first, rows: Rows::Float(frame.rows()?) })
            }
            kind::QUANTISED_VERTICES => {
                Body::Vertices(Vertices { first, rows: Rows::Quantised(frame.rows()?) })
            }
            kind::COMMIT => Body::Commit(frame.commit()?),
            kind => return Err(PacketError::Kind { kind }),
        };
        Ok(Self {
            mesh_id: u32::from_le_bytes([m0, m1, m2, m3]),
            epoch: u32::from_le_bytes([e0, e1, e2, e3]),
            checksum: stated,
            body,
        })
    }
}

/// What the bodies are decoded from.
struct FieldsOfBody<'a> {
    bytes: usize,
    first: u32,
    count: u8,
    rest: &'a [u8],
}

impl<'a> FieldsOfBody<'a> {
    fn length(&self, body: usize) -> PacketError {
        PacketError::Length { bytes: self.bytes, expected: HEADER_BYTES + body + CHECKSUM_BYTES }
    }

    /// A body of fixed size, in a packet that carries no vertices.
    fn fixed<const SIZE: usize>(&self) -> Result<&'a [u8; SIZE], PacketError> {
        zero(self.count == 0, 3)?;
        zero(self.first == 0, 12)?;
        self.rest.try_into().map_err(|_| self.length(SIZE))
    }

    fn begin(&self) -> Result<Begin, PacketError> {
        let &[
            n0,
            n1,
            n2,
            n3,
            encoding,
            p0,
            p1,
            p2,
            x0,
            x1,
            x2,
            x3,
            y0,
            y1,
            y2,
            y3,
            z0,
            z1,
            z2,
            z3,
            u0,
            u1,
            u2,
            u3,
            v0,
            v1,
            v2,
            v3,
            w0,
            w1,
            w2,
            w3,
        ] = self.fixed::<32>()?;
        zero([p0, p1, p2] == [0; 3], HEADER_BYTES + 5)?;
        let origin = [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3];
        let step = [u0, u1, u2, u3, v0, v1, v2, v3, w0, w1, w2, w3];
        let encoding = match encoding {
            0 => {
                zero(origin == [0; 12] && step == [0; 12], HEADER_BYTES + 8)?;
                Encoding::Float
            }
            1 => Encoding::Quantised(
                QuantisedBox::new(float_position(&origin), float_position(&step))
                    .map_err(|BoxError { .. }| PacketError::Box)?,
            ),
            encoding => return Err(PacketError::Encoding { encoding }),
        };
        Ok(Begin { vertices: u32::from_le_bytes([n0, n1, n2, n3]), encoding })
    }

    fn rows<const SIZE: usize>(&self) -> Result<&'a [[u8; SIZE]], PacketError> {
        let (rows, remainder) = self.rest.as_chunks::<SIZE>();
        if rows.len() != usize::from(self.count) || !remainder.is_empty() {
            return Err(self.length(usize::from(self.count) * SIZE));
        }
        if rows.is_empty() { Err(PacketError::Empty) } else { Ok(rows) }
    }

    fn commit(&self) -> Result<Commit, PacketError> {
        Ok(Commit { digest: u32::from_le_bytes(*self.fixed()?) })
    }
}

/// An error unless a reserved field, at this offset, is zero.
fn zero(is_zero: bool, offset: usize) -> Result<(), PacketError> {
    if is_zero { Ok(()) } else { Err(PacketError::Reserved { offset }) }
}

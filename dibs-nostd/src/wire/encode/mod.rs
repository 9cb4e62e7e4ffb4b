//! Packets as bytes, for senders.

// Requirement: B-07

mod frame;
mod weights;

pub use frame::FrameEncoder;
pub use weights::WeightsEncoder;

use core::fmt;

use super::checksum::{checksum, scrambled};
use super::fields::Bytes;
use super::packet::{HAS_ECHO, HAS_POSE, STATUS_BYTES};
use super::{
    Begin, CHECKSUM_BYTES, Content, Counters, Direction, Encoding, FrameId, HEADER_BYTES,
    MAX_CONTENT_PACKETS, MAX_ROWS, MAX_WEIGHTS, MIN_MTU, Mac, Status, StatusAnswer, TAG_BYTES,
    VERSION, kind, padded,
};
use crate::tree::{SurfaceFacts, Unit};

/// Writes a heartbeat to the buffer. `id` has the newest epoch that the sender has begun; before the first frame, that
/// frame's epoch less one. `beat` is incremented each time. `echo` is the clock of the newest status received by the
/// sender.
pub fn encode_heartbeat<'b, M: Mac>(
    id: &FrameId,
    beat: u32,
    echo: Option<u32>,
    mac: &M,
    buffer: &'b mut [u8; MIN_MTU],
) -> &'b [u8] {
    let mut packet = PacketWriter::<M>::with_clock(buffer, kind::HEARTBEAT, id, 0, echo);
    let [_, _, high @ ..] = id.session.to_le_bytes();
    packet.put(&high);
    packet.put(&[if echo.is_some() { HAS_ECHO } else { 0 }, 0]);
    packet.put(&beat.to_le_bytes());
    packet.finish(mac, id.session).0
}

/// Writes a hello to the buffer: `id` as in a heartbeat, and a nonce that was never used before. Its tag does not depend
/// on the challenge of `mac`.
pub fn encode_hello<'b, M: Mac>(
    id: &FrameId,
    nonce: u64,
    mac: &M,
    buffer: &'b mut [u8; MIN_MTU],
) -> &'b [u8] {
    let mut packet = PacketWriter::<M>::new(buffer, kind::HELLO, id, 0, 0, 0);
    let [_, _, high @ ..] = id.session.to_le_bytes();
    packet.put(&high);
    packet.put(&[0; 2]);
    packet.put(&nonce.to_le_bytes());
    packet.finish(mac, id.session).0
}

/// Writes a status to the buffer: the answer to a hello, or otherwise as many counters as fit. The status' number
/// selects them, so that a few statuses report all.
pub fn encode_status<'b, M: Mac, const MTU: usize>(
    mesh_id: u32,
    status: &Status,
    counters: &Counters,
    mac: &M,
    buffer: &'b mut [u8; MTU],
) -> &'b [u8] {
    let room = const { capacity::<M>(MTU, STATUS_BYTES + HEADER_BYTES, 4) };
    let all = counters.from(0).len();
    let pages = all.div_ceil(room as usize);
    let first = (status.number as usize).checked_rem(pages).unwrap_or(0) * room as usize;
    let page = counters.from(first);
    let page = page.get(..room as usize).unwrap_or(page);

    let (session, epoch, age_ms, stretch) = match status.published {
        Some(p) => (p.session, p.epoch, p.age_ms, p.stretch.unwrap_or(0.0)),
        None => (0, 0, 0, 0.0),
    };
    let id = FrameId { mesh_id, session, epoch };
    let mut packet = match status.answer {
        Some(_) => PacketWriter::with_clock(buffer, kind::ANSWER, &id, 0, Some(status.clock)),
        None => {
            PacketWriter::<M>::new(buffer, kind::STATUS, &id, 0, page.len() as u8, first as u32)
        }
    };
    let [_, _, high @ ..] = session.to_le_bytes();
    packet.put(&high);
    let flags = u8::from(status.published.is_some()) | u8::from(status.wants_whole) << 1;
    packet.put(&[flags, status.safety]);
    packet.put(&status.number.to_le_bytes());
    packet.put(&age_ms.to_le_bytes());
    if let Some(StatusAnswer { nonce, challenge, surface }) = &status.answer {
        packet.put(&nonce.to_le_bytes());
        packet.put(&challenge.to_le_bytes());
        packet.surface(surface);
        packet.put(&[0]);
        return packet.finish(mac, session).0;
    }
    packet.put(&stretch.to_le_bytes());
    packet.put(&status.clock.to_le_bytes());
    for counter in page {
        packet.put(&counter.to_le_bytes());
    }
    packet.finish(mac, session).0
}

/// A begin packet without its last fields.
fn begin_packet<'b, M: Mac>(
    buffer: &'b mut [u8],
    id: &FrameId,
    begin: &Begin,
) -> PacketWriter<'b, M> {
    let back = match begin.content {
        Content::Partial { base_epoch } => id.epoch.wrapping_sub(base_epoch) as u16,
        _ => 0,
    };
    let mut packet = PacketWriter::with_clock(buffer, kind::BEGIN, id, back, begin.freshness.echo);
    packet.begin(begin);
    packet
}

/// Number of rows of this size that fit in a packet after `fixed` bytes.
const fn capacity<M: Mac>(mtu: usize, fixed: usize, row: usize) -> u32 {
    assert!(mtu >= MIN_MTU, "a packet needs a transport unit of at least 64 bytes");
    let tag = if M::TAGGED { TAG_BYTES } else { 0 };
    let rows = (mtu - fixed - tag - CHECKSUM_BYTES) / row;
    if rows > 255 { 255 } else { rows as u32 }
}

/// A packet being written. `MTU` and the counts ensure that the buffer is large enough.
struct PacketWriter<'b, M> {
    bytes: Bytes<'b>,
    direction: Direction,
    mac: core::marker::PhantomData<M>,
}

impl<'b, M: Mac> PacketWriter<'b, M> {
    fn new(
        buffer: &'b mut [u8],
        kind: u8,
        id: &FrameId,
        sequence: u16,
        count: u8,
        first: u32,
    ) -> Self {
        let mut bytes = Bytes { buffer, used: 0 };
        let [low, high, ..] = id.session.to_le_bytes();
        bytes.put(&[VERSION, if M::TAGGED { kind | kind::TAGGED } else { kind }, low, high]);
        bytes.put(&id.mesh_id.to_le_bytes());
        bytes.put(&id.epoch.to_le_bytes());
        bytes.put(&sequence.to_le_bytes());
        let [f0, f1, f2, _] = first.to_le_bytes();
        bytes.put(&[count, f0, f1, f2]);
        let direction = match kind {
            kind::STATUS | kind::ANSWER => Direction::ToSender,
            kind::HELLO => Direction::Greeting,
            _ => Direction::ToReceiver,
        };
        Self { bytes, direction, mac: core::marker::PhantomData }
    }

    /// A packet with a time of the receiver's clock in place of count and first row.
    fn with_clock(
        buffer: &'b mut [u8],
        kind: u8,
        id: &FrameId,
        sequence: u16,
        clock: Option<u32>,
    ) -> Self {
        let [count, f0, f1, f2] = clock.unwrap_or(0).to_le_bytes();
        Self::new(buffer, kind, id, sequence, count, u32::from_le_bytes([f0, f1, f2, 0]))
    }

    fn put(&mut self, bytes: &[u8]) {
        self.bytes.put(bytes);
    }

    /// A number of 24 bits; a larger one becomes 0, which means unknown.
    fn put_u24(&mut self, number: u32) {
        let [n0, n1, n2, high] = number.to_le_bytes();
        self.put(&if high == 0 { [n0, n1, n2] } else { [0; 3] });
    }

    fn surface(&mut self, surface: &SurfaceFacts) {
        self.put(&[surface.unit.map_or(0, Unit::code)]);
        self.put_u24(surface.vertices);
        self.put_u24(surface.triangles);
    }

    fn begin(&mut self, begin: &Begin) {
        let [_, _, high @ ..] = begin.session.to_le_bytes();
        self.put(&high);
        let content = match begin.content {
            Content::Whole => 0,
            Content::Partial { .. } => 1,
            Content::Modal => 2,
        };
        let encoding = u8::from(begin.encoding != Encoding::Float);
        let has_echo = if begin.freshness.echo.is_some() { HAS_ECHO } else { 0 };
        self.put(&begin.freshness.age_ms.to_le_bytes());
        let has_pose = if begin.is_posed { HAS_POSE } else { 0 };
        self.put(&[content | encoding << 3 | has_pose | has_echo]);
        if begin.content == Content::Modal {
            self.surface(&begin.surface);
            self.put_u24(begin.rows);
            self.put(&[0; 21]);
            return;
        }
        self.surface(&SurfaceFacts { vertices: begin.rows, ..begin.surface });
        match begin.encoding {
            Encoding::Float => self.put(&[0; 24]),
            Encoding::Quantised(grid) => {
                for coordinate in grid.origin().to_array().iter().chain(&grid.step().to_array()) {
                    self.put(&coordinate.to_le_bytes());
                }
            }
        }
    }

    /// Adds padding, tag and checksum. Returns the packet, and its contribution to the frame's digest.
    fn finish(mut self, mac: &M, session: u32) -> (&'b [u8], u32) {
        let tag_bytes = if M::TAGGED { TAG_BYTES } else { 0 };
        let end = padded(self.bytes.used + tag_bytes + CHECKSUM_BYTES) - tag_bytes - CHECKSUM_BYTES;
        for _ in self.bytes.used..end {
            self.put(&[0]);
        }
        let code = M::TAGGED.then(|| mac.code(self.direction, session, self.bytes.written()));
        if let Some(code) = &code {
            self.put(&code.tag);
        }
        let checksum = checksum(self.bytes.written());
        self.put(&checksum.to_le_bytes());
        let contribution = code.map_or(scrambled(checksum), |code| code.contribution);
        (self.bytes.into_written().unwrap_or_default(), contribution)
    }
}

/// Why a frame cannot be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// No rows, or more than a frame can have.
    Rows {
        /// Rows given.
        rows: usize,
    },
    /// More packets than a frame can have: use a larger transport unit.
    Packets {
        /// Packets needed.
        packets: u32,
    },
    /// The base of a partial frame has another number of vertices.
    Base {
        /// Vertices of the base.
        rows: usize,
    },
    /// The base of a partial frame is not one of the 65,535 epochs before it.
    BaseEpoch {
        /// Epoch of the base.
        epoch: u32,
    },
    /// A position or weight is not finite.
    NotFinite {
        /// The first such row.
        row: u32,
    },
    /// A position is outside the quantisation box.
    OutOfBox {
        /// The first such row.
        row: u32,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rows { rows } => write!(f, "a frame of {rows} rows cannot be sent"),
            Self::Packets { packets } => {
                write!(f, "a frame of {packets} packets cannot be sent: the packets are too small")
            }
            Self::Base { rows } => write!(f, "the base of the partial frame has {rows} rows"),
            Self::BaseEpoch { epoch } => {
                write!(f, "frame {epoch} is too long ago to be the base of a partial frame")
            }
            Self::NotFinite { row } => write!(f, "row {row} is not finite"),
            Self::OutOfBox { row } => write!(f, "row {row} is outside the quantisation box"),
        }
    }
}

impl core::error::Error for EncodeError {}

const _: () = assert!(MAX_ROWS as usize <= usize::MAX && MAX_WEIGHTS < 255);
const _: () = assert!(MAX_CONTENT_PACKETS < u16::MAX as u32);

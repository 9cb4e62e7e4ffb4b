//! One packet, decoded in place.

// Requirement: B-07

use glam::{Quat, Vec3};

use super::checksum::{checksum, scrambled};
use super::fields::Fields;
use super::{
    Begin, Body, BoxError, CHECKSUM_BYTES, Commit, Content, Direction, Encoding, Freshness,
    HEADER_BYTES, Heartbeat, Hello, MAX_ROWS, MAX_WEIGHTS, Mac, POSE_SEQUENCE, PacketError,
    PacketRows, PublishedStatus, QuantisedBox, Status, StatusAnswer, StatusReport, TAG_BYTES,
    VERSION, VertexPacket, Weights, float_position, kind, padded,
};
use crate::surface::{PoseError, RigidPose};
use crate::tree::{SurfaceFacts, Unit};

/// A packet with valid checksum and form. It borrows the decoded bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet<'a> {
    /// Identity of the surface's mesh: `Tree::mesh_id`.
    pub mesh_id: u32,
    /// The low half of the session; [`Begin`], [`Heartbeat`], [`Status`] and [`Hello`] have all of it.
    pub session_low: u16,
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// Sequence number of the packet in its frame: 0 for a begin, from 1 for the packets after it.
    pub sequence: u16,
    /// The packet's CRC-32.
    pub checksum: u32,
    /// The contents of the packet.
    pub body: Body<'a>,
    /// The authenticated bytes, and the tag.
    tag: Option<(&'a [u8], &'a [u8; TAG_BYTES])>,
}

impl<'a> Packet<'a> {
    /// Decodes exactly one packet. Cost: O(bytes), for the checksum; the positions stay where they are.
    ///
    /// ```
    /// use dibs_nostd::wire::{Packet, PacketError};
    /// assert_eq!(Packet::decode(&[4, 1, 0]), Err(PacketError::TooShort { bytes: 3 }));
    /// ```
    ///
    /// # Errors
    /// [`PacketError`] names the first check that failed.
    #[inline]
    pub fn decode(bytes: &'a [u8]) -> Result<Self, PacketError> {
        let too_short = PacketError::TooShort { bytes: bytes.len() };
        let (covered, stated) = bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(too_short)?;
        let (header, rest) = covered.split_first_chunk::<HEADER_BYTES>().ok_or(too_short)?;
        let stated = u32::from_le_bytes(*stated);
        let computed = checksum(covered);
        if stated != computed {
            return Err(PacketError::Checksum { stated, computed });
        }
        let mut fields = Fields(header);
        let version = fields.u8();
        if version != VERSION {
            return Err(PacketError::Version { version });
        }
        let tagged_kind = fields.u8();
        let session_low = fields.u16();
        let mesh_id = fields.u32();
        let epoch = fields.u32();
        let sequence = fields.u16();
        let count = fields.u8();
        let first = fields.u24();
        let (kind, is_tagged) = (tagged_kind & !kind::TAGGED, tagged_kind & kind::TAGGED != 0);
        let size = match kind {
            kind::BEGIN => 36,
            kind::FLOAT_VERTICES => usize::from(count) * 12,
            kind::QUANTISED_VERTICES => usize::from(count) * 6,
            kind::COMMIT => 4,
            kind::WEIGHTS => usize::from(count) * 4,
            kind::HEARTBEAT => 8,
            kind::STATUS => STATUS_BYTES + usize::from(count) * 4,
            kind::HELLO => 12,
            kind::ANSWER => 36,
            kind::POSE => 28,
            _ => return Err(PacketError::Kind { kind: tagged_kind }),
        };
        let tag_bytes = if is_tagged { TAG_BYTES } else { 0 };
        let expected = padded(HEADER_BYTES + size + tag_bytes + CHECKSUM_BYTES);
        let wrong_length = PacketError::Length { bytes: bytes.len(), expected };
        let (body, padding) = rest.split_at_checked(size).ok_or(wrong_length)?;
        if bytes.len() != expected {
            return Err(wrong_length);
        }
        let (padding, tag) = if is_tagged {
            let (padding, tag) = padding.split_last_chunk::<TAG_BYTES>().ok_or(wrong_length)?;
            let signed = covered.get(..covered.len().saturating_sub(TAG_BYTES));
            (padding, Some((signed.unwrap_or_default(), tag)))
        } else {
            (padding, None)
        };
        zero(padding, HEADER_BYTES + size)?;
        match kind {
            kind::FLOAT_VERTICES | kind::QUANTISED_VERTICES | kind::WEIGHTS => {
                if count == 0 {
                    return Err(PacketError::Empty);
                }
            }
            kind::BEGIN | kind::HEARTBEAT | kind::STATUS | kind::ANSWER => (),
            _ => {
                zero(&[count], 14)?;
                zero(&[u8::from(first != 0)], 15)?;
            }
        }
        // Only the packets after a frame's begin have a sequence number.
        let is_placed = matches!(
            kind,
            kind::FLOAT_VERTICES
                | kind::QUANTISED_VERTICES
                | kind::WEIGHTS
                | kind::COMMIT
                | kind::POSE
        );
        let is_misplaced = kind == kind::POSE && sequence != POSE_SEQUENCE;
        if is_misplaced || kind != kind::BEGIN && is_placed != (sequence != 0) {
            return Err(PacketError::Sequence { sequence });
        }
        // Some kinds have a time of the receiver's clock in place of count and first row.
        let clock = first << 8 | u32::from(count);
        let body = match kind {
            kind::BEGIN => Body::Begin(begin(Fields(body), [session_low, sequence], epoch, clock)?),
            kind::FLOAT_VERTICES => {
                Body::Vertices(VertexPacket { first, rows: PacketRows::Float(body.as_chunks().0) })
            }
            kind::QUANTISED_VERTICES => Body::Vertices(VertexPacket {
                first,
                rows: PacketRows::Quantised(body.as_chunks().0),
            }),
            kind::COMMIT => Body::Commit(Commit { digest: Fields(body).u32() }),
            kind::WEIGHTS => Body::Weights(Weights { first, values: body.as_chunks().0 }),
            kind::HEARTBEAT => Body::Heartbeat(heartbeat(Fields(body), session_low, clock)?),
            kind::HELLO => {
                let mut fields = Fields(body);
                let session = session_of(fields.u16(), session_low);
                zero(&fields.take::<2>(), HEADER_BYTES + 2)?;
                Body::Hello(Hello { session, nonce: fields.u64() })
            }
            kind::POSE => Body::Pose(pose(Fields(body))),
            kind::ANSWER => Body::Status(answer(Fields(body), session_low, epoch, clock)?),
            _ => Body::Status(status(Fields(body), session_low, epoch, first)?),
        };
        let sequence = if is_placed { sequence } else { 0 };
        Ok(Self { mesh_id, session_low, epoch, sequence, checksum: stated, body, tag })
    }

    /// The packet's contribution to its frame's digest, if the packet is genuine in this session: its tag matches
    /// `mac`, or it has none and `mac` requires none. Compares in constant time.
    #[must_use]
    #[inline]
    pub fn verify<M: Mac>(&self, mac: &M, session: u32) -> Option<u32> {
        match self.tag {
            Some((signed, tag)) if M::TAGGED => {
                let direction = match self.body {
                    Body::Status(_) => Direction::ToSender,
                    Body::Hello(_) => Direction::Greeting,
                    _ => Direction::ToReceiver,
                };
                let code = mac.code(direction, session, signed);
                let difference =
                    code.tag.iter().zip(tag).fold(0, |difference, (a, b)| difference | (a ^ b));
                (difference == 0).then_some(code.contribution)
            }
            None if !M::TAGGED => Some(scrambled(self.checksum)),
            _ => None,
        }
    }

    /// Whether the packet carries a tag.
    #[must_use]
    pub const fn is_tagged(&self) -> bool {
        self.tag.is_some()
    }

    /// Whether [`verify`](Self::verify) finds the packet genuine.
    #[must_use]
    pub fn is_genuine<M: Mac>(&self, mac: &M, session: u32) -> bool {
        self.verify(mac, session).is_some()
    }
}

pub(super) const STATUS_BYTES: usize = 20;

/// Bit of a begin's form, and of a heartbeat's: the word before the body is an echo.
pub(super) const HAS_ECHO: u8 = 0x80;

/// Bit of a begin's form: the frame comes with a pose.
pub(super) const HAS_POSE: u8 = 0x40;

/// The session from its two halves; the header has the low one.
fn session_of(high: u16, low: u16) -> u32 {
    u32::from(high) << 16 | u32::from(low)
}

fn begin(
    mut fields: Fields<'_>,
    [session_low, back]: [u16; 2],
    epoch: u32,
    echo: u32,
) -> Result<Begin, PacketError> {
    let session = session_of(fields.u16(), session_low);
    let (age_ms, form) = (fields.u16(), fields.u8());
    let surface = facts(&mut fields)?;
    let (content, encoding) = (form & 7, form >> 3 & 7);
    let is_posed = form & HAS_POSE != 0;
    let freshness = Freshness { age_ms, echo: echo_of(form, echo)? };
    let (content, limit) = match content {
        0 => (Content::Whole, MAX_ROWS),
        1 => (Content::Partial { base_epoch: epoch.wrapping_sub(u32::from(back)) }, MAX_ROWS),
        2 => (Content::Modal, MAX_WEIGHTS),
        content => return Err(PacketError::Content { content }),
    };
    if matches!(content, Content::Partial { .. }) != (back != 0) {
        return Err(PacketError::Sequence { sequence: back });
    }
    // A modal frame has its number of weights where others have their box.
    let offset = HEADER_BYTES + 12;
    let (rows, offset) = match content {
        Content::Modal => {
            zero(&[u8::from(is_posed)], HEADER_BYTES + 4)?;
            (fields.u24(), offset + 3)
        }
        _ => (surface.vertices, offset),
    };
    if rows == 0 || rows > limit {
        return Err(PacketError::Rows { rows });
    }
    let encoding = match encoding {
        0 => {
            zero(fields.0, offset)?;
            Encoding::Float
        }
        1 if content != Content::Modal => {
            let (origin, step) = (fields.take(), fields.take());
            Encoding::Quantised(
                QuantisedBox::new(float_position(&origin), float_position(&step))
                    .map_err(|BoxError { .. }| PacketError::Box)?,
            )
        }
        encoding => return Err(PacketError::Encoding { encoding }),
    };
    Ok(Begin { session, content, encoding, rows, surface, freshness, is_posed })
}

/// The pose that a packet states.
#[cold]
#[inline(never)]
fn pose(mut fields: Fields<'_>) -> Result<RigidPose, PoseError> {
    let mut float = || f32::from_bits(fields.u32());
    let rotation = Quat::from_xyzw(float(), float(), float(), float());
    RigidPose::new(rotation, Vec3::new(float(), float(), float()))
}

/// The echo of a packet with these flags.
fn echo_of(flags: u8, echo: u32) -> Result<Option<u32>, PacketError> {
    let has_echo = flags & HAS_ECHO != 0;
    zero(&[u8::from(!has_echo && echo != 0)], 14)?;
    Ok(has_echo.then_some(echo))
}

fn facts(fields: &mut Fields<'_>) -> Result<SurfaceFacts, PacketError> {
    let unit = match fields.u8() {
        0 => None,
        code => Some(Unit::from_code(code).ok_or(PacketError::Unit { unit: code })?),
    };
    Ok(SurfaceFacts { unit, vertices: fields.u24(), triangles: fields.u24() })
}

fn heartbeat(
    mut fields: Fields<'_>,
    session_low: u16,
    echo: u32,
) -> Result<Heartbeat, PacketError> {
    let session = session_of(fields.u16(), session_low);
    let flags = fields.u8();
    zero(&[flags & !HAS_ECHO, fields.u8()], HEADER_BYTES + 2)?;
    Ok(Heartbeat { session, beat: fields.u32(), echo: echo_of(flags, echo)? })
}

/// The common fields of all statuses.
fn status_head(
    fields: &mut Fields<'_>,
    session_low: u16,
    epoch: u32,
    clock: u32,
) -> Result<Status, PacketError> {
    let session = session_of(fields.u16(), session_low);
    let (flags, safety) = (fields.u8(), fields.u8());
    let (number, age_ms) = (fields.u32(), fields.u32());
    zero(&[flags & !3], HEADER_BYTES + 2)?;
    let published = if flags & 1 == 0 {
        zero(&[u8::from(session != 0 || epoch != 0 || age_ms != 0)], HEADER_BYTES)?;
        None
    } else {
        Some(PublishedStatus { session, epoch, age_ms, stretch: None })
    };
    let wants_whole = flags & 2 != 0;
    Ok(Status { published, wants_whole, safety, number, clock, answer: None })
}

fn status(
    mut fields: Fields<'_>,
    session_low: u16,
    epoch: u32,
    first: u32,
) -> Result<StatusReport<'_>, PacketError> {
    let mut status = status_head(&mut fields, session_low, epoch, 0)?;
    let stretch = f32::from_bits(fields.u32());
    status.clock = fields.u32();
    match &mut status.published {
        Some(published) => published.stretch = (stretch > 0.0).then_some(stretch),
        None => zero(&stretch.to_bits().to_le_bytes(), HEADER_BYTES + 12)?,
    }
    let first_counter = u8::try_from(first).map_err(|_| PacketError::Reserved { offset: 16 })?;
    Ok(StatusReport { status, first_counter, counters: fields.0.as_chunks().0 })
}

fn answer(
    mut fields: Fields<'_>,
    session_low: u16,
    epoch: u32,
    clock: u32,
) -> Result<StatusReport<'_>, PacketError> {
    let status = status_head(&mut fields, session_low, epoch, clock)?;
    let (nonce, challenge) = (fields.u64(), fields.u64());
    let surface = facts(&mut fields)?;
    zero(fields.0, HEADER_BYTES + 35)?;
    let answer = Some(StatusAnswer { nonce, challenge, surface });
    Ok(StatusReport { status: Status { answer, ..status }, first_counter: 0, counters: &[] })
}

/// An error unless a reserved field, at this offset, is zero.
#[inline]
fn zero(field: &[u8], offset: usize) -> Result<(), PacketError> {
    if field.iter().all(|&byte| byte == 0) { Ok(()) } else { Err(PacketError::Reserved { offset }) }
}

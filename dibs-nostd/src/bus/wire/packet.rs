//! One packet, decoded in place.

use super::checksum::{checksum, scrambled};
use super::fields::Fields;
use super::{
    Begin, Body, BoxError, CHECKSUM_BYTES, Commit, Content, Direction, Encoding, Freshness,
    HEADER_BYTES, Heartbeat, Hello, MAX_ROWS, MAX_WEIGHTS, Mac, PacketError, PublishedStatus,
    QuantisedBox, Rows, Status, StatusReport, TAG_BYTES, VERSION, Vertices, Weights,
    float_position, kind, padded,
};

/// A packet whose checksum and form are right. It borrows the bytes that it was decoded from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet<'a> {
    /// Identity of the surface's mesh: `Tree::mesh_id`.
    pub mesh_id: u32,
    /// The lower half of the session; [`Begin`], [`Heartbeat`], [`Status`] and [`Hello`] have all of it.
    pub session_low: u16,
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// Place of the packet in its frame: 0 for a begin, from 1 for the packets after it.
    pub sequence: u16,
    /// The packet's CRC-32.
    pub checksum: u32,
    /// The contents of the packet.
    pub body: Body<'a>,
    /// The bytes under the tag, and the tag.
    tag: Option<(&'a [u8], &'a [u8; TAG_BYTES])>,
}

impl<'a> Packet<'a> {
    /// Decodes exactly one packet. Cost: O(bytes), for the checksum; the positions stay where they are.
    ///
    /// ```
    /// use dibs_nostd::wire::{Packet, PacketError};
    /// assert_eq!(Packet::decode(&[3, 1, 0]), Err(PacketError::TooShort { bytes: 3 }));
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
            kind::STATUS => 28 + usize::from(count) * 4,
            kind::HELLO if !is_tagged => 8,
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
            kind::BEGIN | kind::STATUS => (),
            _ => {
                zero(&[count], 14)?;
                zero(&[u8::from(first != 0)], 15)?;
            }
        }
        // Only the packets after a frame's begin have a place in it.
        let is_placed = !matches!(kind, kind::BEGIN | kind::HEARTBEAT | kind::STATUS | kind::HELLO);
        if is_placed != (sequence != 0) {
            return Err(PacketError::Sequence { sequence });
        }
        let body = match kind {
            kind::BEGIN => {
                let echo = first << 8 | u32::from(count);
                Body::Begin(begin(Fields(body), session_low, echo)?)
            }
            kind::FLOAT_VERTICES => {
                Body::Vertices(Vertices { first, rows: Rows::Float(body.as_chunks().0) })
            }
            kind::QUANTISED_VERTICES => {
                Body::Vertices(Vertices { first, rows: Rows::Quantised(body.as_chunks().0) })
            }
            kind::COMMIT => Body::Commit(Commit { digest: Fields(body).u32() }),
            kind::WEIGHTS => Body::Weights(Weights { first, values: body.as_chunks().0 }),
            kind::HEARTBEAT => {
                let [session, beat] = words(Fields(body), session_low)?;
                Body::Heartbeat(Heartbeat { session, beat })
            }
            kind::HELLO => {
                let [session, nonce] = words(Fields(body), session_low)?;
                Body::Hello(Hello { session, nonce })
            }
            _ => Body::Status(status(Fields(body), session_low, epoch, first)?),
        };
        Ok(Self { mesh_id, session_low, epoch, sequence, checksum: stated, body, tag })
    }

    /// The packet's share of its frame's digest, if the packet is genuine in this session: its tag is that of `mac`, or
    /// it carries none and `mac` requires none. Compares in constant time.
    #[must_use]
    #[inline]
    pub fn verify<M: Mac>(&self, mac: &M, session: u32) -> Option<u32> {
        match self.tag {
            Some((signed, tag)) if M::TAGGED => {
                let direction = match self.body {
                    Body::Status(_) => Direction::ToSender,
                    _ => Direction::ToReceiver,
                };
                let code = mac.code(direction, session, signed);
                let difference =
                    code.tag.iter().zip(tag).fold(0, |difference, (a, b)| difference | (a ^ b));
                (difference == 0).then_some(code.share)
            }
            None if !M::TAGGED => Some(scrambled(self.checksum)),
            _ => None,
        }
    }

    /// Whether [`verify`](Self::verify) finds the packet genuine.
    #[must_use]
    pub fn is_genuine<M: Mac>(&self, mac: &M, session: u32) -> bool {
        self.verify(mac, session).is_some()
    }
}

/// Bit of a begin's form: the word before the body is an echo.
pub(super) const HAS_ECHO: u8 = 0x80;

/// The session, whose lower half is in the header.
fn session_of(high: u16, low: u16) -> u32 {
    u32::from(high) << 16 | u32::from(low)
}

fn begin(mut fields: Fields<'_>, session_low: u16, echo: u32) -> Result<Begin, PacketError> {
    let session = session_of(fields.u16(), session_low);
    let (age_ms, form) = (fields.u16(), fields.u8());
    let (rows, base_epoch) = (fields.u24(), fields.u32());
    let (content, encoding, has_echo) = (form & 7, form >> 3 & 7, form & HAS_ECHO != 0);
    zero(&[form & 0x40], HEADER_BYTES + 4)?;
    zero(&[u8::from(!has_echo && echo != 0)], 14)?;
    let freshness = Freshness { age_ms, echo: has_echo.then_some(echo) };
    let grid = fields.0;
    let (origin, step) = (fields.take(), fields.take());
    let (content, limit) = match content {
        0 => (Content::Whole, MAX_ROWS),
        1 => (Content::Partial { base_epoch }, MAX_ROWS),
        2 => (Content::Modal, MAX_WEIGHTS),
        content => return Err(PacketError::Content { content }),
    };
    if rows == 0 || rows > limit {
        return Err(PacketError::Rows { rows });
    }
    if !matches!(content, Content::Partial { .. }) {
        zero(&base_epoch.to_le_bytes(), HEADER_BYTES + 8)?;
    }
    let encoding = match encoding {
        0 => {
            zero(grid, HEADER_BYTES + 12)?;
            Encoding::Float
        }
        1 if content != Content::Modal => Encoding::Quantised(
            QuantisedBox::new(float_position(&origin), float_position(&step))
                .map_err(|BoxError { .. }| PacketError::Box)?,
        ),
        encoding => return Err(PacketError::Encoding { encoding }),
    };
    Ok(Begin { session, content, encoding, rows, freshness })
}

/// The bodies of heartbeat and hello: session and one number.
fn words(mut fields: Fields<'_>, session_low: u16) -> Result<[u32; 2], PacketError> {
    let session = session_of(fields.u16(), session_low);
    zero(&fields.take::<2>(), HEADER_BYTES + 2)?;
    Ok([session, fields.u32()])
}

fn status(
    mut fields: Fields<'_>,
    session_low: u16,
    epoch: u32,
    first: u32,
) -> Result<StatusReport<'_>, PacketError> {
    let session = session_of(fields.u16(), session_low);
    let (flags, safety) = (fields.u8(), fields.u8());
    let number = fields.u32();
    let (age_ms, stretch) = (fields.u32(), f32::from_bits(fields.u32()));
    let (challenge, clock, answer) = (fields.u32(), fields.u32(), fields.u32());
    zero(&[flags & !3], HEADER_BYTES + 2)?;
    let published = if flags & 1 == 0 {
        zero(&[u8::from(session != 0 || epoch != 0 || age_ms != 0)], HEADER_BYTES)?;
        zero(&stretch.to_bits().to_le_bytes(), HEADER_BYTES + 12)?;
        None
    } else {
        let stretch = if stretch > 0.0 { Some(stretch) } else { None };
        Some(PublishedStatus { session, epoch, age_ms, stretch })
    };
    let wants_whole = flags & 2 != 0;
    let status = Status { published, wants_whole, safety, number, clock, answer, challenge };
    let first_counter = u8::try_from(first).map_err(|_| PacketError::Reserved { offset: 16 })?;
    Ok(StatusReport { status, first_counter, counters: fields.0.as_chunks().0 })
}

/// An error unless a reserved field, at this offset, is zero.
#[inline]
fn zero(field: &[u8], offset: usize) -> Result<(), PacketError> {
    if field.iter().all(|&byte| byte == 0) { Ok(()) } else { Err(PacketError::Reserved { offset }) }
}

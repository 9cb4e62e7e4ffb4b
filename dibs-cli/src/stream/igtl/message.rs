//! OpenIGTLink's messages: a header of 58 bytes and a body, big-endian.

use crc::{CRC_64_ECMA_182, Crc, Table};

/// Bytes of a header.
pub const HEADER: usize = 58;

/// The checksum of the body.
const CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_ECMA_182);

/// Bytes of an extended header, from version 2 on.
const EXTENDED: usize = 12;

/// The fields of a header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    version: u16,
    /// The type of the message.
    pub kind: String,
    pub device: String,
    /// Its time in seconds of the sender's clock; 0 if the header does not state it.
    pub time: f64,
    /// Bytes of the body.
    pub size: u64,
    crc: u64,
}

/// Why a message's content cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyError {
    Checksum,
    Layout,
}

impl Header {
    /// `None` for bytes that are not a header.
    pub fn parse(bytes: &[u8; HEADER]) -> Option<Self> {
        let mut rest = &bytes[..];
        let header = Self {
            version: u16_of(&mut rest)?,
            kind: text(take(&mut rest, 12)?).filter(|kind| kind.is_ascii())?,
            device: text(take(&mut rest, 20)?)?,
            time: {
                let (seconds, fraction) = (u32_of(&mut rest)?, u32_of(&mut rest)?);
                f64::from(seconds) + f64::from(fraction) / 4_294_967_296.0
            },
            size: u64_of(&mut rest)?,
            crc: u64_of(&mut rest)?,
        };
        // The versions in use are 1 and 2. Besides these only the type tells a header from other bytes.
        let is_one = (1..=3).contains(&header.version) && !header.kind.is_empty();
        is_one.then_some(header)
    }

    /// The content of a complete body: without the extended header and the metadata of version 2.
    pub fn content<'a>(&self, body: &'a [u8]) -> Result<&'a [u8], BodyError> {
        if CRC.checksum(body) != self.crc {
            return Err(BodyError::Checksum);
        }
        if self.version < 2 {
            return Ok(body);
        }
        let content = || {
            let mut rest = body;
            let extended = usize::from(u16_of(&mut rest)?);
            let index = usize::from(u16_of(&mut rest)?);
            let end = body.len().checked_sub(index)?;
            let end = end.checked_sub(u32_of(&mut rest)? as usize)?;
            body.get(extended..end).filter(|_| extended >= EXTENDED)
        };
        content().ok_or(BodyError::Layout)
    }
}

/// Encodes a message of version 1. `seconds` is the time since 1970.
pub fn pack(kind: &str, device: &str, seconds: f64, body: &[u8]) -> Vec<u8> {
    let mut message = Vec::with_capacity(HEADER + body.len());
    message.extend(1_u16.to_be_bytes());
    for (text, size) in [(kind, 12), (device, 20)] {
        message.extend(text.bytes().chain(std::iter::repeat(0)).take(size));
    }
    message.extend((seconds as u32).to_be_bytes());
    message.extend(((seconds.fract() * 4_294_967_296.0) as u32).to_be_bytes());
    message.extend((body.len() as u64).to_be_bytes());
    message.extend(CRC.checksum(body).to_be_bytes());
    message.extend(body);
    message
}

/// Splits the first bytes off.
pub fn take<'a>(rest: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (first, others) = rest.split_at_checked(count)?;
    *rest = others;
    Some(first)
}

fn array<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    take(rest, N)?.try_into().ok()
}

pub fn u16_of(rest: &mut &[u8]) -> Option<u16> {
    array(rest).map(u16::from_be_bytes)
}

pub fn u32_of(rest: &mut &[u8]) -> Option<u32> {
    array(rest).map(u32::from_be_bytes)
}

fn u64_of(rest: &mut &[u8]) -> Option<u64> {
    array(rest).map(u64::from_be_bytes)
}

/// Text up to the first zero, without control characters, in any encoding.
fn text(bytes: &[u8]) -> Option<String> {
    let text = bytes.split(|&byte| byte == 0).next()?.trim_ascii();
    let is_text = text.iter().all(|byte| !byte.is_ascii_control());
    is_text.then(|| String::from_utf8_lossy(text).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The check value for "123456789" from the catalogue of CRC algorithms.
    #[test]
    fn a_message_is_read_as_it_was_packed() {
        let message = pack("STATUS", "dibs", 1_700_000_000.25, b"123456789");
        assert_eq!(message[50..58], 0x6c40_df5f_0b49_7347_u64.to_be_bytes());
        let header: &[u8; HEADER] = message[..HEADER].try_into().expect("a header");
        let header = Header::parse(header).expect("a header");
        assert_eq!((&*header.kind, &*header.device, header.size), ("STATUS", "dibs", 9));
        assert_eq!(header.time, 1_700_000_000.25);
        assert_eq!(header.content(&message[HEADER..]), Ok(&b"123456789"[..]));
        assert_eq!(header.content(b"123456788"), Err(BodyError::Checksum));
        let mut torn = [0; HEADER];
        torn.copy_from_slice(&message[1..=HEADER]);
        assert_eq!(Header::parse(&torn), None);
    }

    proptest! {
        /// No body makes the extended header exceed its bounds.
        #[test]
        fn sizes_in_a_body_stay_in_it(body in prop::collection::vec(any::<u8>(), 0..64)) {
            let header = Header { version: 2, crc: CRC.checksum(&body), ..Header::default() };
            if let Ok(content) = header.content(&body) {
                prop_assert!(content.len() + EXTENDED <= body.len());
            }
        }
    }
}

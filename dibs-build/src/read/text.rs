//! Normalises the text of a file.

/// A file's bytes as the readers expect them: UTF-16 becomes UTF-8, without a byte order mark.
pub(super) fn normal(bytes: Vec<u8>) -> Vec<u8> {
    match bytes.as_slice() {
        [0xff, 0xfe, rest @ ..] => from_utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => from_utf16(rest, u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, rest @ ..] => rest.to_vec(),
        // UTF-16 without a mark: every second byte of its first words is zero.
        [a, 0, b, 0, c, 0, ..] if [a, b, c].into_iter().all(is_plain) => {
            from_utf16(&bytes, u16::from_le_bytes)
        }
        [0, a, 0, b, 0, c, ..] if [a, b, c].into_iter().all(is_plain) => {
            from_utf16(&bytes, u16::from_be_bytes)
        }
        _ => bytes,
    }
}

fn is_plain(byte: &u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}

fn from_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
    let units = bytes.as_chunks::<2>().0.iter().map(|&pair| unit(pair));
    let letters = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
    letters.collect::<String>().into_bytes()
}

/// A text without the zeros or the end-of-file mark (Control-Z) that some programs append.
pub(super) fn trimmed(bytes: &[u8]) -> &[u8] {
    let is_end = |byte: &u8| matches!(byte, 0 | 0x1a) || byte.is_ascii_whitespace();
    let length = bytes.iter().rposition(|byte| !is_end(byte)).map_or(0, |last| last + 1);
    &bytes[..length]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_becomes_utf8() {
        let text = "v 0 0 ß\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            [b"\xff\xfe", &little[..]].concat(),
            [b"\xfe\xff", &big[..]].concat(),
            little,
            big,
        ] {
            assert_eq!(normal(bytes.clone()), text.as_bytes(), "{bytes:?}");
        }
        assert_eq!(trimmed(b"f 1 2 3\n\0\0"), b"f 1 2 3");
        assert_eq!(trimmed(b"\0"), b"");
    }
}

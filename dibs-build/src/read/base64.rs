//! Base64, in which text formats hold binary data.

/// Decodes up to the first character that is none. Padding may occur inside: VTK's arrays are several runs in
/// a row, each padded. `None` where a run is cut off.
pub(super) fn decode(text: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let digits = text.iter().copied().filter(|byte| !byte.is_ascii_whitespace());
    let digits: Vec<u8> =
        digits.take_while(|&byte| byte == b'=' || value(byte).is_some()).collect();
    let (quads, rest) = digits.as_chunks::<4>();
    for quad in quads {
        let padding = quad.iter().rev().take_while(|&&byte| byte == b'=').count();
        if padding > 2 || quad[..4 - padding].contains(&b'=') {
            return None;
        }
        let bits = quad.iter().fold(0, |bits, &byte| bits << 6 | value(byte).unwrap_or(0));
        bytes.extend(&bits.to_be_bytes()[1..4 - padding]);
    }
    rest.is_empty().then_some(bytes)
}

fn value(digit: u8) -> Option<u32> {
    let value = match digit {
        b'A'..=b'Z' => digit - b'A',
        b'a'..=b'z' => digit - b'a' + 26,
        b'0'..=b'9' => digit - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    };
    Some(value.into())
}

#[cfg(test)]
mod tests {
    use super::decode;

    /// The vectors of RFC 4648, section 10.
    #[test]
    fn it_decodes() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
            (" Zg==\nZm8=Zm9v <", "ffofoo"),
        ] {
            assert_eq!(decode(text.as_bytes()).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        assert_eq!(decode(&[255, 62, 191].map(|_| b'/')), None);
        for text in ["Zg=", "Z===", "Zg=v", "Zm9"] {
            assert_eq!(decode(text.as_bytes()), None, "{text}");
        }
    }
}

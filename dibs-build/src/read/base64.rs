//! Base64, the encoding of binary data in text formats.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// Decodes up to the first character that is not Base64. Padding may occur inside: VTK's arrays are several runs in a
/// row, each padded. `None` where a run is cut off.
pub(super) fn decode(text: &[u8]) -> Option<Vec<u8>> {
    let is_digit = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'+' | b'/' | b'=');
    let digits = text.iter().copied().filter(|byte| !byte.is_ascii_whitespace());
    let digits: Vec<u8> = digits.take_while(is_digit).collect();
    let (quads, rest) = digits.as_chunks::<4>();
    let mut bytes = Vec::with_capacity(3 * quads.len());
    // Padding ends a run.
    for run in quads.split_inclusive(|quad| quad[3] == b'=') {
        BASE64_STANDARD.decode_vec(run.as_flattened(), &mut bytes).ok()?;
    }
    rest.is_empty().then_some(bytes)
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

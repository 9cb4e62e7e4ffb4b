//! Reads a tree's bytes only by `docs/format.md`.

use dibs_nostd::format::CRC;

/// Offset and length of a section.
///
/// # Panics
/// If there is none of this kind.
#[must_use]
pub fn section(bytes: &[u8], kind: u32) -> (usize, usize) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let row = (0..word(48) as usize).map(|r| 80 + 12 * r).find(|&at| word(at) == kind);
    let at = row.expect("the section is there");
    (word(at + 4) as usize, word(at + 8) as usize)
}

/// Corrects the checksum of changed bytes.
///
/// # Panics
/// If there are fewer bytes than a header has.
pub fn reseal(bytes: &mut [u8]) {
    let mut digest = CRC.digest();
    digest.update(&bytes[..60]);
    digest.update(&bytes[64..]);
    bytes[60..64].copy_from_slice(&digest.finalize().to_le_bytes());
}

//! Reads a tree's bytes only by `docs/format.md`.

use dibs_nostd::format::CRC;

/// The number at an offset.
///
/// # Panics
/// If it is not within the bytes.
#[must_use]
pub fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

/// Changes numbers, each at its offset, and corrects the checksum, so that only they are wrong.
///
/// # Panics
/// If one is not within the bytes.
#[must_use]
pub fn with_words(bytes: &[u8], words: &[(usize, u32)]) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    for &(at, value) in words {
        changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
    }
    reseal(&mut changed);
    changed
}

/// Offset of a section's row in the table of sections: its kind, offset and length.
///
/// # Panics
/// If there is none of this kind.
#[must_use]
pub fn row_of_section(bytes: &[u8], kind: u32) -> usize {
    let mut rows = (0..word(bytes, 48) as usize).map(|row| 80 + 12 * row);
    rows.find(|&at| word(bytes, at) == kind).expect("the section is there")
}

/// Offset and length of a section.
///
/// # Panics
/// If there is none of this kind.
#[must_use]
pub fn section(bytes: &[u8], kind: u32) -> (usize, usize) {
    let at = row_of_section(bytes, kind);
    (word(bytes, at + 4) as usize, word(bytes, at + 8) as usize)
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

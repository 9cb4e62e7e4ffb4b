//! The one writer of a tree's bytes: header, table of sections, sections, checksum.

// Requirement: M-01

use dibs_nostd::format::{CRC, HEADER_BYTES, SECTION_ALIGN, SECTION_BYTES, field};

use crate::error::BuildError;

/// The bytes of a tree with these sections, each with its kind. This fills in the header's count of sections, length
/// and checksum.
pub(super) fn write(
    mut header: [u8; HEADER_BYTES],
    sections: &[(u32, &[u8])],
) -> Result<Vec<u8>, BuildError> {
    let mut offset = (HEADER_BYTES + sections.len() * SECTION_BYTES) as u64;
    let mut table = Vec::new();
    for (kind, content) in sections {
        offset = offset.next_multiple_of(SECTION_ALIGN as u64);
        for word in [*kind, offset as u32, content.len() as u32] {
            table.extend(word.to_le_bytes());
        }
        offset += content.len() as u64;
    }
    let length = u32::try_from(offset).map_err(|_| BuildError::TooLarge { bytes: offset })?;
    put_word(&mut header, field::SECTIONS, sections.len() as u32);
    put_word(&mut header, field::LENGTH, length);

    let mut bytes = Vec::with_capacity(length as usize);
    bytes.extend(header);
    bytes.extend(table);
    for (_, content) in sections {
        bytes.resize(bytes.len().next_multiple_of(SECTION_ALIGN), 0);
        bytes.extend(*content);
    }
    let mut digest = CRC.digest();
    digest.update(&bytes[..field::CHECKSUM]);
    digest.update(&bytes[field::CHECKSUM + 4..]);
    put_word(&mut bytes, field::CHECKSUM, digest.finalize());
    Ok(bytes)
}

/// The bytes of a valid tree with a section appended.
#[cfg(feature = "modes")]
pub(super) fn append(tree: &[u8], kind: u32, content: &[u8]) -> Result<Vec<u8>, BuildError> {
    let mut header = [0; HEADER_BYTES];
    header.copy_from_slice(&tree[..HEADER_BYTES]);
    let word = |at: usize| u32::from_le_bytes([tree[at], tree[at + 1], tree[at + 2], tree[at + 3]]);
    let mut sections: Vec<(u32, &[u8])> = (0..word(field::SECTIONS) as usize)
        .map(|row| HEADER_BYTES + row * SECTION_BYTES)
        .map(|at| (word(at), &tree[word(at + 4) as usize..][..word(at + 8) as usize]))
        .collect();
    sections.push((kind, content));
    write(header, &sections)
}

/// Puts a number into a field of the header.
pub(super) fn put_word(header: &mut [u8], at: usize, word: u32) {
    header[at..at + 4].copy_from_slice(&word.to_le_bytes());
}

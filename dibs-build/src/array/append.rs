//! One more section for a tree that was built before.

use dibs_nostd::format::{CHECKSUM_AT, CRC, HEADER_BYTES, SECTION_ALIGN, SECTION_BYTES};

use crate::error::BuildError;

/// Where the header has the number of sections and the length.
const SECTIONS_AT: usize = 48;
const LENGTH_AT: usize = 52;

/// The bytes of a valid tree with a section appended.
pub(crate) fn append(tree: &[u8], kind: u32, content: &[u8]) -> Result<Vec<u8>, BuildError> {
    let word = |at: usize| u32::from_le_bytes([tree[at], tree[at + 1], tree[at + 2], tree[at + 3]]);
    let mut table: Vec<([u32; 2], &[u8])> = Vec::new();
    for row in 0..word(SECTIONS_AT) as usize {
        let at = HEADER_BYTES + row * SECTION_BYTES;
        let [kind, offset, length] = [word(at), word(at + 4), word(at + 8)];
        let part = &tree[offset as usize..][..length as usize];
        table.push(([kind, length], part));
    }
    let length = content.len() as u32;
    table.push(([kind, length], content));

    let mut bytes = tree[..HEADER_BYTES].to_vec();
    let mut offset = (HEADER_BYTES + table.len() * SECTION_BYTES) as u64;
    for ([kind, length], _) in &table {
        offset = offset.next_multiple_of(SECTION_ALIGN as u64);
        for field in [*kind, offset as u32, *length] {
            bytes.extend(field.to_le_bytes());
        }
        offset += u64::from(*length);
    }
    let Ok(length) = u32::try_from(offset) else {
        return Err(BuildError::TooLarge { bytes: offset });
    };
    for (_, part) in &table {
        bytes.resize(bytes.len().next_multiple_of(SECTION_ALIGN), 0);
        bytes.extend(*part);
    }
    bytes[SECTIONS_AT..][..4].copy_from_slice(&(table.len() as u32).to_le_bytes());
    bytes[LENGTH_AT..][..4].copy_from_slice(&length.to_le_bytes());
    let mut digest = CRC.digest();
    digest.update(&bytes[..CHECKSUM_AT]);
    digest.update(&bytes[CHECKSUM_AT + 4..]);
    bytes[CHECKSUM_AT..][..4].copy_from_slice(&digest.finalize().to_le_bytes());
    Ok(bytes)
}

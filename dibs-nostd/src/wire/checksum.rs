//! The packets' CRC-32, four bytes at a time.
//!
//! The `crc` crate with its small table works byte by byte, which would be most of a packet's cost to a receiver. With
//! its large table (16 KiB) a panic branch remains. So this module computes the same remainder with four tables of 1
//! KiB, made from the crate's; a test compares the two.

// Requirement: B-06

/// `TABLES[k][byte]`: the remainder of a byte followed by `k` zero bytes.
static TABLES: [[u32; 256]; 4] = tables();

const fn tables() -> [[u32; 256]; 4] {
    let crc: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let [first] = *crc.table();
    let mut tables = [first; 4];
    let mut k = 1;
    while k < 4 {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[k - 1][byte];
            tables[k][byte] = (before >> 8) ^ first[(before & 255) as usize];
            byte += 1;
        }
        k += 1;
    }
    tables
}

/// CRC-32 (ISO-HDLC). O(bytes).
#[inline]
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    let [t0, t1, t2, t3] = &TABLES;
    // The compiler removes the check: an 8-bit index into 256 entries.
    let at = |table: &[u32; 256], byte: u8| table.get(usize::from(byte)).copied().unwrap_or(0);
    let (words, rest) = bytes.as_chunks::<4>();
    let mut remainder = u32::MAX;
    for word in words {
        let [b0, b1, b2, b3] = (remainder ^ u32::from_le_bytes(*word)).to_le_bytes();
        remainder = at(t3, b0) ^ at(t2, b1) ^ at(t1, b2) ^ at(t0, b3);
    }
    for byte in rest {
        let [low, ..] = (remainder ^ u32::from(*byte)).to_le_bytes();
        remainder = (remainder >> 8) ^ at(t0, low);
    }
    !remainder
}

/// An untagged packet's contribution to its frame's digest: its checksum through a bijection that removes the
/// checksum's linearity (the last step of `MurmurHash3`).
#[inline]
pub(super) const fn scrambled(checksum: u32) -> u32 {
    let mixed = (checksum ^ (checksum >> 16)).wrapping_mul(0x85EB_CA6B);
    let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0xC2B2_AE35);
    mixed ^ (mixed >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::format::CRC;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_remainder_is_the_crates(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
            prop_assert_eq!(checksum(&bytes), CRC.checksum(&bytes));
        }
    }
}

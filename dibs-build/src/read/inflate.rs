//! Decompression with a bound on the size of the result.

use std::io::{self, Read};

/// Coordinates and numbers shrink to a third or a tenth. Data that grow more than this are made to fill the memory.
const MOST_GROWTH: u64 = 200;

/// Most bytes that a plausible file decompresses to.
pub(super) fn most(compressed: usize) -> u64 {
    (compressed as u64).saturating_mul(MOST_GROWTH).saturating_add(1 << 16)
}

/// Reads to the end; an error if there are more bytes than `compressed` ones plausibly decompress to.
pub(super) fn read(data: impl Read, compressed: usize) -> io::Result<Vec<u8>> {
    read_some(data, compressed, most(compressed))
}

/// Reads to the end; an error if there are more than `room` bytes. The error names the size `compressed`.
pub(super) fn read_some(data: impl Read, compressed: usize, room: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if data.take(room.saturating_add(1)).read_to_end(&mut bytes)? as u64 > room {
        let what = format!("{compressed} compressed bytes become more than {}", most(compressed));
        return Err(io::Error::other(what));
    }
    Ok(bytes)
}

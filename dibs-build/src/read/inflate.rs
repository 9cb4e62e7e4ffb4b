//! Compressed data, with a bound on what it may become.

use std::io::{self, Read};

/// Coordinates and numbers shrink to a third or a tenth; what grows more than this was made to fill the memory.
const MOST_GROWTH: u64 = 200;

/// Reads to the end, at most so much as `compressed` bytes can honestly hold.
pub(super) fn read(data: impl Read, compressed: usize) -> io::Result<Vec<u8>> {
    let most = (compressed as u64).saturating_mul(MOST_GROWTH).saturating_add(1 << 16);
    let mut bytes = Vec::new();
    if data.take(most + 1).read_to_end(&mut bytes)? as u64 > most {
        let what = format!("{compressed} compressed bytes become more than {most}");
        return Err(io::Error::other(what));
    }
    Ok(bytes)
}

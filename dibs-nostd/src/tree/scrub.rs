//! Finds changed bytes of a tree while the controller runs: the checksum, a few bytes at a time.

// Requirement: M-02

use core::fmt;

use crate::tree::format::field::CHECKSUM;
use crate::tree::format::{CRC, u32_at};

/// An endless background check of a tree's bytes against their checksum.
///
/// Validation at start-up does not see later changes of the flash, and a query does not detect every flipped bit: a
/// radius or an index that is wrong but possible gives a wrong answer. A scrub detects a change within two rounds,
/// since the current round may be past it already, with a bounded number of bytes in each call.
///
/// With 64 bytes a tick at 1 kHz, a round over a tree of 100 kB takes 1.6 s. [`CRC`] lists the damage that the checksum
/// certainly detects; of other damage one pattern in 2^32 is missed.
///
/// ```
/// use dibs_nostd::{CorruptTreeError, Scrub};
///
/// # let mesh = dibs_build::generate::heart(320).unwrap().mesh;
/// # let built = dibs_build::Builder::new().build(&mesh).unwrap();
/// let mut bytes = built.blob().to_vec();
/// let mut scrub = Scrub::new(&bytes);
/// while scrub.rounds() < 2 {
///     scrub.step(64)?; // once a tick
/// }
///
/// bytes[200] ^= 1;
/// let mut scrub = Scrub::new(&bytes);
/// let found = (0..bytes.len()).find_map(|_| scrub.step(64).err());
/// assert!(matches!(found, Some(CorruptTreeError { .. })));
/// # Ok::<(), CorruptTreeError>(())
/// ```
#[derive(Clone)]
pub struct Scrub<'a> {
    bytes: &'a [u8],
    at: usize,
    digest: crc::Digest<'static, u32>,
    rounds: u32,
}

/// A tree's bytes changed after they were written: distances may be wrong until a sound copy replaces them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct CorruptTreeError {
    /// The checksum in the header.
    pub stated: u32,
    /// The checksum of the bytes.
    pub computed: u32,
}

impl fmt::Display for CorruptTreeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stated, computed } = self;
        write!(
            f,
            "the tree's bytes changed: checksum {computed:08x}, the header states {stated:08x}"
        )
    }
}

impl core::error::Error for CorruptTreeError {}

impl<'a> Scrub<'a> {
    /// A check of all bytes of a tree, the same as given to [`Tree::from_bytes`](crate::Tree::from_bytes).
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, digest: CRC.digest(), rounds: 0 }
    }

    /// Checks the next `most` bytes, and at the end of a round compares the checksum. After an error, the next round
    /// shows whether the bytes are still wrong.
    ///
    /// Cost: linear in `most`, about ten instructions a byte on a Cortex-M7.
    ///
    /// # Errors
    /// [`CorruptTreeError`] at the end of a round in which the bytes did not match their checksum.
    pub fn step(&mut self, most: usize) -> Result<(), CorruptTreeError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let part = rest.get(..most).unwrap_or(rest);
        // The checksum does not cover itself.
        let skipped = CHECKSUM.saturating_sub(self.at);
        let before = part.get(..skipped).unwrap_or(part);
        let after = part.get((CHECKSUM + 4).saturating_sub(self.at)..).unwrap_or_default();
        self.digest.update(before);
        self.digest.update(after);
        self.at = self.at.saturating_add(part.len());
        if self.at < self.bytes.len() {
            return Ok(());
        }
        let digest = core::mem::replace(&mut self.digest, CRC.digest());
        let computed = digest.finalize();
        self.at = 0;
        self.rounds = self.rounds.wrapping_add(1);
        match u32_at(self.bytes, CHECKSUM) {
            Some(stated) if stated == computed => Ok(()),
            stated => Err(CorruptTreeError { stated: stated.unwrap_or_default(), computed }),
        }
    }

    /// Completed rounds; wraps.
    #[must_use]
    pub const fn rounds(&self) -> u32 {
        self.rounds
    }
}

impl fmt::Debug for Scrub<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bytes, at, rounds, .. } = self;
        write!(f, "Scrub {{ at: {at} of {} bytes, rounds: {rounds} }}", bytes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec::Vec;

    #[test]
    fn every_flipped_bit_is_found_whatever_the_step() {
        let mesh = dibs_build::generate::heart(320).expect("a valid size").mesh;
        let built = dibs_build::Builder::new().build(&mesh).expect("a valid mesh");
        let sound: Vec<u8> = built.blob().into();
        for count in [1, 7, 61, 64, 1_000, usize::MAX] {
            let mut scrub = Scrub::new(&sound);
            while scrub.rounds() < 3 {
                assert_eq!(scrub.step(count), Ok(()), "{count} bytes a call");
            }
        }
        let mut bytes = sound;
        for at in 0..bytes.len() {
            bytes[at] ^= 1 << (at % 8);
            let mut scrub = Scrub::new(&bytes);
            let mut found = Ok(());
            while scrub.rounds() < 1 {
                found = scrub.step(333);
            }
            assert!(found.is_err(), "byte {at}");
            bytes[at] ^= 1 << (at % 8);
        }
    }

    #[test]
    fn every_flipped_bit_of_the_decoded_header_is_found() {
        let mesh = dibs_build::generate::heart(320).expect("a valid size").mesh;
        let built = dibs_build::Builder::new().build(&mesh).expect("a valid mesh");
        let bytes = built.blob();
        let sound = crate::Tree::<u16>::from_bytes(bytes).expect("a valid tree");
        assert_eq!(sound.check(bytes), Ok(()));
        let flip = |value: f32, bit| f32::from_bits(value.to_bits() ^ bit);
        let mut flips = 0;
        for bit in (0..32).map(|shift| 1_u32 << shift) {
            for field in 0..12 {
                let mut tree = sound;
                let header = &mut tree.header;
                match field {
                    0 => header.mesh_id ^= bit,
                    1 => header.vertices ^= bit,
                    2 => header.triangles ^= bit,
                    3 => header.nodes ^= bit,
                    4 => header.stack ^= bit,
                    5 => header.stretch = flip(header.stretch, bit),
                    6 => header.radius_unit = flip(header.radius_unit, bit),
                    7 => header.position_error = flip(header.position_error, bit),
                    8 => header.sections ^= bit,
                    9 => header.origin ^= bit,
                    10 => header.other_roots ^= bit,
                    _ => header.checksum ^= bit,
                }
                assert!(tree.check(bytes).is_err(), "field {field}, bit {bit:x}");
                flips += 1;
            }
        }
        assert_eq!(flips, 384);
        let mut other = sound;
        other.header.paths = crate::format::PathKind::EdgePath;
        assert!(other.check(bytes).is_err());
        let shorter = |part: &mut &[u8]| {
            *part = part.get(1..).unwrap_or_default();
        };
        for section in 0..6 {
            let mut tree = sound;
            match section {
                0 => shorter(&mut tree.sections.nodes),
                1 => shorter(&mut tree.sections.triangles),
                2 => shorter(&mut tree.sections.rest),
                3 => shorter(&mut tree.sections.order),
                4 => shorter(&mut tree.sections.adjacency),
                _ => shorter(&mut tree.sections.metric),
            }
            assert!(tree.check(bytes).is_err(), "section {section}");
        }
        // Equal bytes at another address are a misplaced section.
        let copy: Vec<u8> = bytes.into();
        assert!(sound.check(&copy).is_err());
    }

    #[test]
    fn bytes_too_short_for_a_header_are_rot() {
        for length in [0, 1, 59, 62, 63] {
            assert!(Scrub::new(&[0; 64][..length]).step(64).is_err(), "{length} bytes");
        }
    }
}

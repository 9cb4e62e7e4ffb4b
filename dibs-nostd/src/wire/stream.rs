//! Packets on a byte stream: COBS frames, each ended by a zero byte.
//!
//! The coding is that of the `cobs` crate, and a test compares this decoder with the crate's. The crate's buffered
//! decoder reports a packet that exceeded the buffer as complete, but truncated. Its state machine takes some thirty
//! instructions a byte on a Cortex-M7, more than the rest of a packet's cost; this one takes a third of that, and less
//! if bytes come in slices.

// Requirement: B-09

use core::fmt;

/// Largest size on the stream of a packet of `bytes` bytes, with the zero that ends it.
#[must_use]
pub const fn framed_bytes(bytes: usize) -> usize {
    // COBS adds one byte, and one more for each full 254.
    bytes.saturating_add(bytes / 254).saturating_add(2)
}

/// Writes a packet to `out` as one COBS frame with its final zero; `None` if `out` is shorter than [`framed_bytes`].
///
/// ```
/// use dibs_nostd::wire::{enframe, framed_bytes};
/// let mut out = [0; framed_bytes(3)];
/// assert_eq!(enframe(&[7, 0, 9], &mut out), Some(&[2, 7, 2, 9, 0][..]));
/// ```
pub fn enframe<'b>(packet: &[u8], out: &'b mut [u8]) -> Option<&'b [u8]> {
    let used = cobs::try_encode(packet, out).ok()?;
    *out.get_mut(used)? = 0;
    out.get(..used.checked_add(1)?)
}

/// Extracts packets of at most `MTU` bytes from a byte stream, one byte at a time.
///
/// After damage it resynchronises at the next zero byte. O(1) for each byte.
///
/// ```
/// use dibs_nostd::wire::Deframer;
/// let mut deframer = Deframer::<64>::new();
/// for byte in [2, 7, 2, 9] {
///     assert!(deframer.push(byte).is_none());
/// }
/// assert_eq!(deframer.push(0), Some(Ok(&[7, 0, 9][..])));
/// ```
#[derive(Debug)]
pub struct Deframer<const MTU: usize> {
    /// No vector: a finished packet is lent until the next byte, which is the first of another packet.
    packet: [u8; MTU],
    /// Bytes decoded so far; one more than `MTU` for a packet that does not fit.
    bytes: usize,
    /// Bytes left before the next code byte.
    left: u8,
    /// Whether the next code byte also stands for a zero in the packet.
    is_zero_due: bool,
}

impl<const MTU: usize> Deframer<MTU> {
    /// A deframer that may start anywhere in a stream.
    #[must_use]
    pub const fn new() -> Self {
        Self { packet: [0; MTU], bytes: 0, left: 0, is_zero_due: false }
    }

    /// Takes one byte, and returns the packet that it completes, if any. The packet is valid until the next call.
    ///
    /// # Errors
    /// [`StreamError`] at the end of a packet that is too long, truncated or damaged.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], StreamError>> {
        if byte == 0 {
            return self.end();
        }
        if self.left != 0 {
            self.left = self.left.wrapping_sub(1);
            self.store(byte);
        } else {
            self.code(byte);
        }
        None
    }

    /// Takes bytes up to the end of the first packet among them. Returns the number taken, and the packet. Call it
    /// again with the rest. It costs less than [`push`](Self::push) of each byte.
    ///
    /// ```
    /// use dibs_nostd::wire::Deframer;
    /// let mut deframer = Deframer::<64>::new();
    /// let received = [2, 7, 2, 9, 0, 2, 8];
    /// assert_eq!(deframer.extend(&received), (5, Some(Ok(&[7, 0, 9][..]))));
    /// assert_eq!(deframer.extend(&received[5..]), (2, None));
    /// ```
    #[inline]
    pub fn extend(&mut self, bytes: &[u8]) -> (usize, Option<Result<&[u8], StreamError>>) {
        let mut rest = bytes;
        // Each iteration takes at least one byte.
        while let Some((&byte, after)) = rest.split_first() {
            if byte == 0 {
                return (bytes.len() - after.len(), self.end());
            }
            if self.left == 0 {
                self.code(byte);
                rest = after;
                continue;
            }
            let block = rest.get(..usize::from(self.left)).unwrap_or(rest);
            let run = block.get(..nonzero(block)).unwrap_or_default();
            let end = self.bytes.saturating_add(run.len());
            match self.packet.get_mut(self.bytes..end) {
                Some(room) => {
                    for (to, from) in room.iter_mut().zip(run) {
                        *to = *from;
                    }
                    self.bytes = end;
                }
                None => self.bytes = MTU.saturating_add(1),
            }
            // A run is no longer than the rest of the block.
            self.left = self.left.wrapping_sub(run.len() as u8);
            rest = rest.get(run.len()..).unwrap_or_default();
        }
        (bytes.len(), None)
    }

    /// A code byte: the number of bytes before the next one, which stands for a zero unless this is 255.
    #[inline]
    fn code(&mut self, byte: u8) {
        if self.is_zero_due {
            self.store(0);
        }
        self.left = byte.wrapping_sub(1);
        self.is_zero_due = byte != u8::MAX;
    }

    #[inline]
    fn store(&mut self, byte: u8) {
        match self.packet.get_mut(self.bytes) {
            Some(slot) => {
                *slot = byte;
                self.bytes = self.bytes.wrapping_add(1);
            }
            None => self.bytes = MTU.saturating_add(1),
        }
    }

    fn end(&mut self) -> Option<Result<&[u8], StreamError>> {
        let Self { bytes, left, is_zero_due, .. } = *self;
        (self.bytes, self.left, self.is_zero_due) = (0, 0, false);
        if left != 0 {
            Some(Err(StreamError::Cut { bytes }))
        } else if bytes == 0 && !is_zero_due {
            // No byte since the last zero.
            None
        } else {
            Some(self.packet.get(..bytes).ok_or(StreamError::TooLong { bytes, limit: MTU }))
        }
    }
}

/// Bytes before the first zero.
#[inline]
fn nonzero(bytes: &[u8]) -> usize {
    let (words, _) = bytes.as_chunks::<4>();
    let has_no_zero = |word: &&[u8; 4]| {
        let word = u32::from_le_bytes(**word);
        word.wrapping_sub(0x0101_0101) & !word & 0x8080_8080 == 0
    };
    let start = words.iter().take_while(has_no_zero).count() * 4;
    let rest = bytes.get(start..).unwrap_or_default();
    start + rest.iter().position(|&byte| byte == 0).unwrap_or(rest.len())
}

impl<const MTU: usize> Default for Deframer<MTU> {
    fn default() -> Self {
        Self::new()
    }
}

/// Why the bytes between two zeros were not a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StreamError {
    /// More bytes than a packet may have.
    TooLong {
        /// Bytes of the packet so far.
        bytes: usize,
        /// The largest packet.
        limit: usize,
    },
    /// A zero before the end that the COBS counts announce.
    Cut {
        /// Bytes decoded.
        bytes: usize,
    },
}

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong { bytes, limit } => {
                write!(f, "a packet of {bytes} bytes where {limit} fit")
            }
            Self::Cut { bytes } => write!(f, "a packet cut off after {bytes} bytes"),
        }
    }
}

impl core::error::Error for StreamError {}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use cobs::{DecodeResult, DecoderState};
    use proptest::prelude::*;
    use std::vec::Vec;

    const MTU: usize = 300;
    type Outcome = Result<Vec<u8>, StreamError>;

    /// The `cobs` crate's state machine, on a stream.
    fn reference(stream: &[u8]) -> Vec<Outcome> {
        let mut state = DecoderState::Idle;
        let (mut packet, mut outcomes) = (Vec::new(), Vec::new());
        for &byte in stream {
            match state.feed(byte) {
                Ok(DecodeResult::NoData) => {}
                Ok(DecodeResult::DataStart) => packet.clear(),
                Ok(DecodeResult::DataContinue(decoded)) => packet.push(decoded),
                Ok(DecodeResult::DataComplete) if packet.len() > MTU => {
                    outcomes.push(Err(StreamError::TooLong { bytes: MTU + 1, limit: MTU }));
                }
                Ok(DecodeResult::DataComplete) => outcomes.push(Ok(packet.clone())),
                Err(_) => outcomes.push(Err(StreamError::Cut { bytes: packet.len().min(MTU + 1) })),
            }
        }
        outcomes
    }

    fn byte() -> impl Strategy<Value = u8> {
        prop_oneof![2 => 1..5_u8, 1 => Just(0), 1 => Just(255), 2 => any::<u8>()]
    }

    /// Runs of one byte, so that blocks are full, packets too long, and zeros rare.
    fn stream() -> impl Strategy<Value = Vec<u8>> {
        prop::collection::vec((byte(), prop_oneof![3 => 1..4_usize, 1 => 200..400_usize]), 0..20)
            .prop_map(|runs| {
                runs.iter().flat_map(|&(byte, n)| std::iter::repeat_n(byte, n)).collect()
            })
    }

    /// A block without bytes between two zeros is a packet without bytes; zeros alone are none.
    #[test]
    fn a_packet_may_be_empty() {
        let stream = [0, 0, 1, 0, 0, 2, 7, 0, 0];
        let mut deframer = Deframer::<MTU>::new();
        let mut outcomes = Vec::new();
        for byte in stream {
            outcomes.extend(deframer.push(byte).map(|outcome| outcome.map(<[u8]>::to_vec)));
        }
        let expected: [Outcome; 2] = [Ok(Vec::new()), Ok(Vec::from([7]))];
        assert_eq!(outcomes, expected);
        assert_eq!(outcomes, reference(&stream));
        let mut framed = [9; framed_bytes(0)];
        assert_eq!(enframe(&[], &mut framed), Some(&[1, 0][..]));
    }

    proptest! {
        #[test]
        fn any_stream_is_decoded_as_the_crate_does(
            stream in stream(), cuts in prop::collection::vec(1..50_usize, 1..10),
        ) {
            let mut deframer = Deframer::<MTU>::new();
            let mut by_byte = Vec::new();
            for &byte in &stream {
                by_byte.extend(deframer.push(byte).map(|outcome| outcome.map(<[u8]>::to_vec)));
            }
            prop_assert_eq!(&by_byte, &reference(&stream));

            let mut deframer = Deframer::<MTU>::new();
            let (mut by_slice, mut rest) = (Vec::new(), &stream[..]);
            for &cut in cuts.iter().cycle() {
                let chunk = &rest[..cut.min(rest.len())];
                let (taken, outcome) = deframer.extend(chunk);
                prop_assert!(taken == chunk.len() || outcome.is_some() || chunk[taken - 1] == 0);
                by_slice.extend(outcome.map(|outcome| outcome.map(<[u8]>::to_vec)));
                rest = &rest[taken..];
                if rest.is_empty() {
                    break;
                }
            }
            prop_assert_eq!(&by_slice, &by_byte);
        }
    }
}

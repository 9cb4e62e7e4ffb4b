//! Packets on a byte stream: COBS frames, each ended by a zero byte.
//!
//! The coding is the `cobs` crate's. Its own buffered decoder reports a packet that overran the
//! buffer as complete, cut short; so this module takes only its state machine, and keeps the buffer
//! and the count of what did not fit.

use core::fmt;

use cobs::{DecodeResult, DecoderState};

/// Largest size on the stream of a packet of `bytes` bytes, with the zero that ends it.
#[must_use]
pub const fn framed_bytes(bytes: usize) -> usize {
    // COBS adds one byte, and one more for each full 254.
    bytes.saturating_add(bytes / 254).saturating_add(2)
}

/// Writes a packet to `out` as one COBS frame with the zero that ends it; `None` where `out` is too
/// small: [`framed_bytes`] tells.
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

/// Takes packets of at most `MTU` bytes out of a byte stream, one byte at a time.
///
/// After any damage it is in step again at the next zero byte. O(1) a byte.
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
    state: DecoderState,
    packet: [u8; MTU],
    /// Bytes decoded so far; above `MTU` for a packet that does not fit.
    bytes: usize,
}

impl<const MTU: usize> Deframer<MTU> {
    /// A deframer at the start of a stream, or anywhere in one.
    #[must_use]
    pub const fn new() -> Self {
        Self { state: DecoderState::Idle, packet: [0; MTU], bytes: 0 }
    }

    /// Takes one byte; the packet that it completes, if it does. The packet stands until the next
    /// call.
    ///
    /// # Errors
    /// [`StreamError`] at the end of a packet that is too long, or of one that was cut or damaged.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], StreamError>> {
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.bytes = 0;
                None
            }
            Ok(DecodeResult::DataContinue(decoded)) => {
                if let Some(place) = self.packet.get_mut(self.bytes) {
                    *place = decoded;
                }
                self.bytes = self.bytes.saturating_add(1);
                None
            }
            Ok(DecodeResult::DataComplete) => Some(
                self.packet
                    .get(..self.bytes)
                    .ok_or(StreamError::TooLong { bytes: self.bytes, limit: MTU }),
            ),
            Err(_) => Some(Err(StreamError::Cut { bytes: self.bytes })),
        }
    }
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
        /// Bytes decoded.
        bytes: usize,
        /// The largest packet.
        limit: usize,
    },
    /// A zero before the end that the frame's own counts announce.
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

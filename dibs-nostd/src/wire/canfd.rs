//! Packets as CAN-FD messages: data length codes and identifiers, for any driver.
//!
//! A packet of at most 64 bytes has one of CAN-FD's lengths, so a message's data is the packet. This maps onto plain
//! numbers and slices, and with the feature `embedded-can` onto the frames of drivers that have that crate's trait.
//!
//! ```
//! use dibs_nostd::wire::canfd::{Identifiers, dlc_of};
//! # let packet = [2, 4, 0, 0, 0xD1, 0xB5, 1, 0, 9, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
//! let identifiers = Identifiers::new(0x120).unwrap();
//! let identifier = identifiers.of(&packet); // a commit travels with its frame
//! assert_eq!(identifier, 0x122);
//! assert_eq!(dlc_of(packet.len()), Some(12));
//! ```

// Requirement: B-09

#[cfg(feature = "embedded-can")]
use embedded_can::{Frame, Id, StandardId};

use super::kind;

/// Lengths of a CAN-FD message, by its data length code.
#[doc(hidden)]
pub const LENGTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// The data length code of the shortest message that holds this many bytes; `None` above 64.
#[must_use]
pub const fn dlc_of(bytes: usize) -> Option<u8> {
    Some(match bytes {
        0..=8 => bytes as u8,
        9..=12 => 9,
        13..=16 => 10,
        17..=20 => 11,
        21..=24 => 12,
        25..=32 => 13,
        33..=48 => 14,
        49..=64 => 15,
        _ => return None,
    })
}

/// Bytes of a message with this data length code; the code's upper four bits are ignored.
#[must_use]
pub(super) const fn length_of(dlc: u8) -> usize {
    match dlc & 15 {
        15 => 64,
        14 => 48,
        13 => 32,
        short if short <= 8 => short as usize,
        // 12, 16, 20, 24
        middle => (middle as usize - 6) * 4,
    }
}

/// The three identifiers of one surface; the lowest has priority on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identifiers {
    base: u16,
}

impl Identifiers {
    /// The identifiers `base` (heartbeats), `base + 1` (statuses) and `base + 2` (frames): 11 bits
    /// each, `None` beyond.
    ///
    /// All packets of frames share one identifier, because CAN keeps the order only within one.
    #[must_use]
    pub const fn new(base: u16) -> Option<Self> {
        if base <= 0x7FD { Some(Self { base }) } else { None }
    }

    /// The identifier with which to send a packet.
    #[must_use]
    pub fn of(self, packet: &[u8]) -> u16 {
        match packet.get(1).map(|kind| kind & !kind::TAGGED) {
            Some(kind::HEARTBEAT) => self.base,
            Some(kind::STATUS) => self.base.wrapping_add(1),
            _ => self.base.wrapping_add(2),
        }
    }

    /// Whether a message with this identifier is for the receiver of the surface.
    #[must_use]
    pub const fn is_to_receiver(self, identifier: u16) -> bool {
        matches!(identifier.wrapping_sub(self.base), 0 | 2)
    }

    /// Whether a message with this identifier is for the sender of the surface.
    #[must_use]
    pub const fn is_to_sender(self, identifier: u16) -> bool {
        identifier.wrapping_sub(self.base) == 1
    }
}

/// Frames of drivers: the trait's documentation is of CAN with 8 bytes, and drivers implement it for frames of CAN-FD, too.
#[cfg(feature = "embedded-can")]
impl Identifiers {
    /// The message that carries a packet; `None` if it does not fit into the driver's frame.
    #[must_use]
    pub fn frame_of<F: Frame>(self, packet: &[u8]) -> Option<F> {
        F::new(StandardId::new(self.of(packet))?, packet)
    }

    /// The packet in a message for the receiver of the surface; `None` if it is another message.
    #[must_use]
    pub fn packet_to_receiver<F: Frame>(self, frame: &F) -> Option<&[u8]> {
        let is_ours = standard(frame).is_some_and(|identifier| self.is_to_receiver(identifier));
        is_ours.then(|| frame.data())
    }

    /// The packet in a message for the sender of the surface; `None` if it is another message.
    #[must_use]
    pub fn packet_to_sender<F: Frame>(self, frame: &F) -> Option<&[u8]> {
        let is_ours = standard(frame).is_some_and(|identifier| self.is_to_sender(identifier));
        is_ours.then(|| frame.data())
    }
}

/// The identifier of a data frame, if it has 11 bits.
#[cfg(feature = "embedded-can")]
fn standard<F: Frame>(frame: &F) -> Option<u16> {
    match frame.id() {
        Id::Standard(identifier) if frame.is_data_frame() => Some(identifier.as_raw()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_that_of_its_length() {
        for (code, bytes) in (0..).zip(LENGTHS.map(usize::from)) {
            assert_eq!((dlc_of(bytes), length_of(code)), (Some(code), bytes));
            assert_eq!(length_of(code | 0xF0), bytes, "the upper four bits are ignored");
        }
    }
}

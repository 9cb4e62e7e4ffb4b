//! AES-128-CMAC, AUTOSAR's choice for secure onboard communication.

// Requirement: B-03

use core::fmt;

use aes::Aes128;
use cmac::{Cmac, KeyInit, Mac as _};

use super::{Code, Direction, Mac};

/// Tags by AES-128-CMAC (RFC 4493, NIST SP 800-38B), cut to 48 bits.
///
/// Each direction has a key of its own, derived from the shared key and the receiver's id (NIST SP 800-108, counter
/// mode): a packet for one receiver is a forgery to another, and so is a packet returned to its sender.
///
/// The cipher is the crate `aes`, in constant time, without tables. A board with a hardware cipher implements [`Mac`]
/// with it.
///
/// RAM: two expanded keys, some 800 bytes, and half as much again while a code is computed. Dropping it does not erase
/// the keys.
///
/// ```
/// use dibs_nostd::wire::{AesCmac, Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{Assembler, Frames, Millis, ReceiveError, NoAdmissionCheck, glam::Vec3};
///
/// let key = *b"a secret of ours";
/// let receiver = 7; // this controller's number
/// let challenge = 0x5EED; // drawn at start-up; the sender reads it from the answer to its hello
/// let frames = Frames::<2>::new();
/// let (writer, mut reader) = frames.split().unwrap();
/// let mac = AesCmac::new(&key, receiver, challenge);
/// let mut assembler = Assembler::with_mac(writer, NoAdmissionCheck, 0xB0D1, 1e3, mac);
///
/// let mut send = |key: &[u8; 16], epoch| {
///     let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch };
///     let positions = [Vec3::X, Vec3::Y];
///     let mut frame = FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..])
///         .and_then(|frame| frame.with_mac(AesCmac::new(key, receiver, challenge)))
///         .unwrap();
///     let mut buffer = [0; 64];
///     while let Some(packet) = frame.next_packet(&mut buffer) {
///         assembler.accept(packet, Millis(0))?;
///     }
///     assembler.advance(100)
/// };
/// assert_eq!(send(b"another's guess.", 1), Err(ReceiveError::Forged { epoch: 1 }));
/// assert!(send(&key, 1).is_ok());
/// assert!(reader.read().is_some());
/// ```
#[derive(Clone)]
pub struct AesCmac {
    to_receiver: Cmac<Aes128>,
    to_sender: Cmac<Aes128>,
    challenge: u64,
}

impl AesCmac {
    /// Codes under a shared key, for the receiver with this id, bound to its challenge.
    ///
    /// No two receivers under one key may have the same id. The receiver draws the challenge when it starts: a random
    /// number, or a counter that survives a restart. With 0, recordings of an earlier run are accepted until a later
    /// session has published.
    #[must_use]
    pub fn new(key: &[u8; 16], receiver: u32, challenge: u64) -> Self {
        Self {
            to_receiver: derived(key, b"dibs to receiver", receiver),
            to_sender: derived(key, b"dibs to sender", receiver),
            challenge,
        }
    }

    /// The same key with another challenge: for a sender that has received it in an answer.
    #[must_use]
    pub fn with_challenge(mut self, challenge: u64) -> Self {
        self.challenge = challenge;
        self
    }
}

/// Derives the key of one direction: SP 800-108 in counter mode with CMAC, one block.
fn derived(key: &[u8; 16], label: &[u8], receiver: u32) -> Cmac<Aes128> {
    let (counter, end, bits) = ([1], [0], 128_u32.to_be_bytes());
    let key =
        code(&Cmac::new(key.into()), &[&counter, label, &end, &receiver.to_le_bytes(), &bits]);
    Cmac::new(&key.into())
}

/// The code of the concatenated parts.
fn code(mac: &Cmac<Aes128>, parts: &[&[u8]]) -> [u8; 16] {
    let mut mac = mac.clone();
    for part in parts {
        mac.update(part);
    }
    mac.finalize().into_bytes().into()
}

impl Mac for AesCmac {
    const TAGGED: bool = true;

    fn code(&self, direction: Direction, session: u32, packet: &[u8]) -> Code {
        let (mac, challenge) = match direction {
            Direction::ToReceiver => (&self.to_receiver, self.challenge),
            Direction::ToSender => (&self.to_sender, self.challenge),
            Direction::Greeting => (&self.to_receiver, 0),
        };
        let code = code(mac, &[&challenge.to_le_bytes(), &session.to_le_bytes(), packet]);
        let [t0, t1, t2, t3, t4, t5, h0, h1, h2, h3, ..] = code;
        Code { tag: [t0, t1, t2, t3, t4, t5], contribution: u32::from_le_bytes([h0, h1, h2, h3]) }
    }

    fn challenge(&self) -> u64 {
        self.challenge
    }
}

/// Without the keys.
impl fmt::Debug for AesCmac {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AesCmac").field("challenge", &self.challenge).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vectors of RFC 4493, in one part and in two.
    #[test]
    fn the_code_is_that_of_rfc_4493() {
        let key = 0x2b7e_1516_28ae_d2a6_abf7_1588_09cf_4f3c_u128.to_be_bytes();
        let message = [
            0x6bc1_bee2_2e40_9f96_e93d_7e11_7393_172a_u128,
            0xae2d_8a57_1e03_ac9c_9eb7_6fac_45af_8e51,
            0x30c8_1c46_a35c_e411_e5fb_c119_1a0a_52ef,
            0xf69f_2445_df4f_9b17_ad2b_417b_e66c_3710,
        ]
        .map(u128::to_be_bytes);
        let message = message.as_flattened();
        for (length, expected) in [
            (0, 0xbb1d_6929_e959_3728_7fa3_7d12_9b75_6746_u128),
            (16, 0x070a_16b4_6b4d_4144_f79b_dd9d_d04a_287c),
            (40, 0xdfa6_6747_de9a_e630_30ca_3261_1497_c827),
            (64, 0x51f0_bebf_7e3b_9d92_fc49_7417_7936_3cfe),
        ] {
            let mac = Cmac::new(&key.into());
            let (start, end) = message[..length].split_at(length / 3);
            assert_eq!(code(&mac, &[start, end]), expected.to_be_bytes());
            assert_eq!(code(&mac, &[&message[..length]]), expected.to_be_bytes());
        }
    }
}

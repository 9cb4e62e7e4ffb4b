//! AES-128-CMAC, as AUTOSAR takes it for secure onboard communication.

use core::fmt;

use aes::Aes128;
use cmac::{Cmac, KeyInit, Mac as _};

use super::{Mac, TAG_BYTES};

/// Tags by AES-128-CMAC (RFC 4493, NIST SP 800-38B), cut to 48 bits.
///
/// The cipher is that of the crate `aes`, in constant time, without tables. A board with a hardware cipher
/// implements [`Mac`] with that.
///
/// RAM: the expanded key, some 700 bytes while a tag is made. The key is not erased when this is
/// dropped.
///
/// ```
/// use dibs_nostd::wire::{AesCmac, Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{Assembler, Frames, Rejection, Unchecked, glam::Vec3};
///
/// let key = *b"a secret of ours";
/// let challenge = 0x5EED; // drawn at start-up; the sender reads it from the status
/// let frames = Frames::<2>::new();
/// let (writer, mut reader) = frames.split().unwrap();
/// let mac = AesCmac::new(&key, challenge);
/// let mut assembler = Assembler::with_mac(writer, Unchecked, 0xB0D1, 1e3, mac);
///
/// let mut send = |key: &[u8; 16], epoch| {
///     let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch };
///     let positions = [Vec3::X, Vec3::Y];
///     let mut frame = FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..])
///         .and_then(|frame| frame.with_mac(AesCmac::new(key, challenge)))
///         .unwrap();
///     let mut buffer = [0; 64];
///     while let Some(packet) = frame.next_packet(&mut buffer) {
///         assembler.accept(packet, 0)?;
///     }
///     assembler.advance(100)
/// };
/// assert_eq!(send(b"another's guess.", 1), Err(Rejection::Forged { epoch: 1 }));
/// assert!(send(&key, 1).is_ok());
/// assert!(reader.read().is_some());
/// ```
#[derive(Clone)]
pub struct AesCmac {
    mac: Cmac<Aes128>,
    challenge: u32,
}

impl AesCmac {
    /// Tags under a key that both sides have, bound to the receiver's challenge.
    ///
    /// The receiver draws the challenge when it starts: a random number, or a counter that survives a
    /// restart; with 0, recordings of an earlier run are believed until a later session has published.
    #[must_use]
    pub fn new(key: &[u8; 16], challenge: u32) -> Self {
        Self { mac: Cmac::new(key.into()), challenge }
    }

    /// The same key, bound to another challenge: for a sender that has read it from a status.
    #[must_use]
    pub fn with_challenge(mut self, challenge: u32) -> Self {
        self.challenge = challenge;
        self
    }
}

impl Mac for AesCmac {
    const TAGGED: bool = true;

    fn tag(&self, session: u32, packet: &[u8]) -> [u8; TAG_BYTES] {
        let mut mac = self.mac.clone();
        let [c0, c1, c2, c3] = self.challenge.to_le_bytes();
        let [s0, s1, s2, s3] = session.to_le_bytes();
        mac.update(&[c0, c1, c2, c3, s0, s1, s2, s3]);
        mac.update(packet);
        let code: [u8; 16] = mac.finalize().into_bytes().into();
        let [t0, t1, t2, t3, t4, t5, ..] = code;
        [t0, t1, t2, t3, t4, t5]
    }

    fn challenge(&self) -> u32 {
        self.challenge
    }
}

/// Without the key.
impl fmt::Debug for AesCmac {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AesCmac").field("challenge", &self.challenge).finish_non_exhaustive()
    }
}

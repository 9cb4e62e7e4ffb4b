//! Message authentication: what a packet's tag is made by.

/// Bytes of a tag: the first 48 bits of a message authentication code.
///
/// With 48 bits a CAN-FD message holds six quantised positions or three `f32` ones, and a guess is
/// right once in 2^48. AUTOSAR's `SecOC` takes 24 to 64 bits.
pub const TAG_BYTES: usize = 6;

/// Makes the tags of packets, and so decides what is genuine.
///
/// Sender and receiver hold the same key and the same *challenge*: a number that the receiver draws
/// when it starts and reports in its status, so that recordings from before are worth nothing.
pub trait Mac {
    /// Whether packets carry a tag. A receiver takes only packets with, or only packets without.
    const TAGGED: bool;

    /// The tag over challenge, session and packet (all bytes before the tag). Cost: linear in the
    /// packet.
    fn tag(&self, session: u32, packet: &[u8]) -> [u8; TAG_BYTES];

    /// The challenge in use; 0 where there is none.
    fn challenge(&self) -> u32 {
        0
    }
}

/// No authentication: whoever can write to the bus is believed.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMac;

impl Mac for NoMac {
    const TAGGED: bool = false;

    fn tag(&self, _: u32, _: &[u8]) -> [u8; TAG_BYTES] {
        [0; TAG_BYTES]
    }
}

impl<M: Mac> Mac for &M {
    const TAGGED: bool = M::TAGGED;

    fn tag(&self, session: u32, packet: &[u8]) -> [u8; TAG_BYTES] {
        (**self).tag(session, packet)
    }

    fn challenge(&self) -> u32 {
        (**self).challenge()
    }
}

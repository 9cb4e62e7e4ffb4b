//! Message authentication of packets.

// Requirement: B-03

/// Bytes of a tag: the first 48 bits of a message authentication code.
///
/// With 48 bits a CAN-FD message holds six quantised positions or three `f32` ones, and a guess is right once in 2^48.
/// AUTOSAR's `SecOC` takes 24 to 64 bits.
pub const TAG_BYTES: usize = 6;

/// Computes the authentication codes of packets.
///
/// Sender and receiver have the same key, the same receiver id and the same *challenge*: a number that the receiver
/// draws when it starts and reports in its status, so that earlier recordings are not genuine.
pub trait Mac {
    /// Whether packets carry a tag. A receiver takes only tagged packets, or only packets without a tag.
    const TAGGED: bool;

    /// The code over challenge (0 for [`Direction::Greeting`]), session and packet (all bytes before the tag), under the
    /// key of this direction. Cost: linear in the packet.
    fn code(&self, direction: Direction, session: u32, packet: &[u8]) -> Code;

    /// The current challenge; 0 if there is none.
    fn challenge(&self) -> u64 {
        0
    }
}

/// A packet's direction. Each has its own key, so that a packet cannot be returned as an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Frames and heartbeats.
    ToReceiver,
    /// Statuses.
    ToSender,
    /// Hellos: as to the receiver, but with the challenge 0.
    Greeting,
}

/// A packet's message authentication code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// The part sent with the packet.
    pub tag: [u8; TAG_BYTES],
    /// A part that is never sent: the digest in a frame's commit is its sum over the frame, so that without the key
    /// nobody can tell which packets of two frames give the same sum.
    pub contribution: u32,
}

/// No authentication: a receiver accepts packets from everyone who can write to the bus.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMac;

impl Mac for NoMac {
    const TAGGED: bool = false;

    fn code(&self, _: Direction, _: u32, _: &[u8]) -> Code {
        Code { tag: [0; TAG_BYTES], contribution: 0 }
    }
}

impl<M: Mac> Mac for &M {
    const TAGGED: bool = M::TAGGED;

    fn code(&self, direction: Direction, session: u32, packet: &[u8]) -> Code {
        (**self).code(direction, session, packet)
    }

    fn challenge(&self) -> u64 {
        (**self).challenge()
    }
}

//! Transports of packets: datagrams, or COBS frames on a byte stream.

// Requirement: B-09

mod line;
mod target;

use std::io;

pub use line::{Datagrams, Line, Refusals};
pub use target::{Target, TargetError};

/// The transport of a [`Sender`](crate::Sender).
///
/// [`Line`] implements it for serial lines and sockets; a CAN adapter or a fault injector would be another
/// implementation.
pub trait Transport {
    /// Sends one whole packet. May block for as long as the line is busy.
    ///
    /// # Errors
    /// The operating system's error; the connection is then unusable.
    fn send(&mut self, packet: &[u8]) -> io::Result<()>;

    /// The next received packet, if any. Does not block.
    ///
    /// # Errors
    /// [`io::ErrorKind::UnexpectedEof`] when the other side has closed the connection.
    fn receive(&mut self) -> io::Result<Option<Vec<u8>>>;
}

/// Collects packets, for tests and for programs that transport them themselves.
impl Transport for Vec<Vec<u8>> {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        self.push(packet.to_vec());
        Ok(())
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        Ok(None)
    }
}

impl<T: Transport + ?Sized> Transport for Box<T> {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        (**self).send(packet)
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        (**self).receive()
    }
}

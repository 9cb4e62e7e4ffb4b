//! How packets travel: as datagrams, or as COBS frames on a byte stream.

mod line;
mod target;

use std::io;

pub use line::Line;
pub use target::{Target, TargetError};

/// The way out of a [`Sender`](crate::stream::Sender).
///
/// [`Line`] is the one for serial lines and sockets; a CAN adapter, or a fault injector between sender
/// and receiver, is another implementation.
pub trait Transport {
    /// Sends one packet, whole. May block for as long as the line is busy.
    ///
    /// # Errors
    /// The operating system's error; the connection is then of no use any more.
    fn send(&mut self, packet: &[u8]) -> io::Result<()>;

    /// The next packet that came back, `None` if none is there. Does not block.
    ///
    /// # Errors
    /// [`io::ErrorKind::UnexpectedEof`] when the other side has closed the connection.
    fn receive(&mut self) -> io::Result<Option<Vec<u8>>>;
}

/// Collects packets: for tests, and for programs that carry them by themselves.
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

//! A serial line or a socket, with a reading thread.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

#[cfg(unix)]
use std::os::unix::net::UnixStream;

use dibs_nostd::wire::{Deframer, MAX_PACKET, enframe, framed_bytes};
use serial2::SerialPort;

use super::Transport;

/// A line that accepts no byte for this long is stuck: on a slow line a packet takes about a second.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// Interval at which a blocked write checks whether to stop, and the reading thread whether its owner still exists.
const PATIENCE: Duration = Duration::from_millis(50);

/// A serial line or a socket. A separate thread reads, so that neither direction waits for the other.
pub struct Line {
    writer: Box<dyn Write + Send>,
    is_stream: bool,
    framed: Vec<u8>,
    received: Receiver<io::Result<Vec<u8>>>,
    over: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    refusals: SharedRefusals,
    /// Ends the connection. The argument tells whether bytes that were written may be dropped.
    hang_up: Box<dyn Fn(bool) + Send>,
}

/// Datagrams that were rejected: the network reports that nothing listens at the address.
#[derive(Clone, Copy, Debug, Default)]
pub struct Refusals {
    /// Their number, as far as the network reports it.
    pub count: u64,
    /// Time of the last rejection.
    pub last: Option<Instant>,
}

/// Counted by both threads.
#[derive(Clone, Debug, Default)]
struct SharedRefusals(Arc<Mutex<Refusals>>);

impl SharedRefusals {
    fn get(&self) -> Refusals {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts the rejection of an earlier datagram; returns other errors.
    fn count(&self, error: io::Error) -> io::Result<()> {
        match error.kind() {
            ErrorKind::ConnectionRefused
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable => {
                let mut refusals = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                *refusals = Refusals { count: refusals.count + 1, last: Some(Instant::now()) };
                Ok(())
            }
            _ => Err(error),
        }
    }
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_over = self.over.load(Ordering::Relaxed);
        let mut line = f.debug_struct("Line");
        line.field("is_stream", &self.is_stream).field("is_over", &is_over).finish_non_exhaustive()
    }
}

impl Line {
    /// A serial port: 8 data bits, no parity, 1 stop bit, no flow control.
    ///
    /// # Errors
    /// If the port cannot be shared with the reading thread.
    pub fn serial(mut port: SerialPort) -> io::Result<Self> {
        port.set_read_timeout(PATIENCE)?;
        port.set_write_timeout(PATIENCE)?;
        let (reader, handle) = (port.try_clone()?, port.try_clone()?);
        // Closing the port waits for the bytes that have not been sent.
        let discard = move |is_stopped| {
            if is_stopped {
                drop(handle.discard_output_buffer());
            }
        };
        Ok(Self::bytes(Port(port), reader, discard))
    }

    /// A TCP connection.
    ///
    /// # Errors
    /// When the socket cannot be shared with the reading thread.
    pub fn tcp(socket: TcpStream) -> io::Result<Self> {
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(PATIENCE))?;
        socket.set_write_timeout(Some(PATIENCE))?;
        let (reader, handle) = (socket.try_clone()?, socket.try_clone()?);
        Ok(Self::stream(socket, reader, move || drop(handle.shutdown(Shutdown::Both))))
    }

    /// A Unix socket, such as that of an emulator's serial line.
    ///
    /// # Errors
    /// When the socket cannot be shared with the reading thread.
    #[cfg(unix)]
    pub fn unix(socket: UnixStream) -> io::Result<Self> {
        socket.set_read_timeout(Some(PATIENCE))?;
        socket.set_write_timeout(Some(PATIENCE))?;
        let (reader, handle) = (socket.try_clone()?, socket.try_clone()?);
        Ok(Self::stream(socket, reader, move || drop(handle.shutdown(Shutdown::Both))))
    }

    /// A UDP socket that is connected to its peer: one packet a datagram. Datagrams that nobody receives are lost,
    /// since a receiver may start later; [`refusals`](Self::refusals) counts those that were rejected.
    ///
    /// # Errors
    /// When the socket cannot be shared with the reading thread.
    pub fn udp(socket: UdpSocket) -> io::Result<Self> {
        Self::udp_paced(socket, |datagrams| datagrams)
    }

    /// The same, through a writer of your own, for example one that does not overrun a small receiver: it gets one
    /// packet a write, then a flush.
    ///
    /// # Errors
    /// When the socket cannot be shared with the reading thread.
    pub fn udp_paced<W: Write + Send + 'static>(
        socket: UdpSocket,
        writer: impl FnOnce(Datagrams) -> W,
    ) -> io::Result<Self> {
        socket.set_read_timeout(Some(PATIENCE))?;
        let (reader, refusals) = (socket.try_clone()?, SharedRefusals::default());
        let (here, there) = (refusals.clone(), refusals.clone());
        let mut line = Self::datagrams(writer(Datagrams(socket, here)), move |buffer| {
            // There is no receiver yet: the sender continues, as after any lost datagram.
            reader.recv(buffer).or_else(|error| there.count(error).map(|()| 0))
        });
        line.refusals = refusals;
        Ok(line)
    }

    /// Any line that preserves packet boundaries: a write is a packet, and `read` returns the next received one, 0
    /// bytes if there is none. A long read should time out from time to time.
    pub fn datagrams(
        writer: impl Write + Send + 'static,
        mut read: impl FnMut(&mut [u8]) -> io::Result<usize> + Send + 'static,
    ) -> Self {
        let mut buffer = vec![0; MAX_PACKET];
        Self::new(
            writer,
            false,
            |_| (),
            move |packets| {
                let bytes = read(&mut buffer)?;
                packets.extend((bytes > 0).then(|| buffer[..bytes].to_vec()));
                Ok(())
            },
        )
    }

    /// Any byte stream with a reading and a writing end. A long read should time out from time to time, or end when
    /// `hang_up` is called: the reading thread lives until the read returns.
    pub fn stream(
        writer: impl Write + Send + 'static,
        reader: impl Read + Send + 'static,
        hang_up: impl Fn() + Send + 'static,
    ) -> Self {
        Self::bytes(writer, reader, move |_| hang_up())
    }

    fn bytes(
        writer: impl Write + Send + 'static,
        mut reader: impl Read + Send + 'static,
        hang_up: impl Fn(bool) + Send + 'static,
    ) -> Self {
        let mut deframer = Deframer::<MAX_PACKET>::new();
        let mut buffer = [0; 4096];
        Self::new(writer, true, hang_up, move |packets| {
            let bytes = reader.read(&mut buffer)?;
            if bytes == 0 {
                return Err(ErrorKind::UnexpectedEof.into());
            }
            // A damaged status is dropped: the next one follows.
            let whole = buffer[..bytes]
                .iter()
                .filter_map(|&byte| deframer.push(byte).and_then(Result::ok).map(<[u8]>::to_vec));
            packets.extend(whole);
            Ok(())
        })
    }

    fn new(
        writer: impl Write + Send + 'static,
        is_stream: bool,
        hang_up: impl Fn(bool) + Send + 'static,
        mut read: impl FnMut(&mut Vec<Vec<u8>>) -> io::Result<()> + Send + 'static,
    ) -> Self {
        let (to_owner, received) = channel();
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        thread::spawn(move || {
            let mut packets = Vec::new();
            while !is_over.load(Ordering::Relaxed) {
                match read(&mut packets) {
                    Ok(()) => (),
                    Err(error) if is_patience(&error) => (),
                    Err(error) => {
                        // The owner may no longer exist.
                        let _ = to_owner.send(Err(error));
                        return;
                    }
                }
                for packet in packets.drain(..) {
                    if to_owner.send(Ok(packet)).is_err() {
                        return;
                    }
                }
            }
        });
        Self {
            writer: Box::new(writer),
            is_stream,
            framed: vec![0; framed_bytes(MAX_PACKET)],
            received,
            over,
            stop: Arc::default(),
            refusals: SharedRefusals::default(),
            hang_up: Box::new(hang_up),
        }
    }

    /// Whether packets are framed on a byte stream, and not datagrams.
    #[must_use]
    pub const fn is_stream(&self) -> bool {
        self.is_stream
    }

    /// The same line, but once `stop` is set and the line accepts nothing, writes end with an error within a twentieth
    /// of a second. Bytes that a serial port has not sent are then dropped. A writer of your own must time out for
    /// this.
    #[must_use]
    pub fn until(mut self, stop: Arc<AtomicBool>) -> Self {
        self.stop = stop;
        self
    }

    /// Datagrams that were rejected.
    #[must_use]
    pub fn refusals(&self) -> Refusals {
        self.refusals.get()
    }

    /// Sends bytes unchanged, even a damaged packet. For fault injection.
    ///
    /// # Errors
    /// The operating system's error.
    pub fn send_raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        write(&mut self.writer, bytes, &self.stop)
    }
}

impl Transport for Line {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        let bytes = if self.is_stream {
            enframe(packet, &mut self.framed)
                .ok_or_else(|| io::Error::other("a packet larger than any"))?
        } else {
            packet
        };
        write(&mut self.writer, bytes, &self.stop)
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        match self.received.try_recv() {
            Ok(packet) => packet.map(Some),
            Err(TryRecvError::Empty) => Ok(None),
            // The thread ends only after an error, which an earlier call has returned.
            Err(TryRecvError::Disconnected) => Err(ErrorKind::UnexpectedEof.into()),
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        (self.hang_up)(self.stop.load(Ordering::Relaxed));
    }
}

/// Writes all bytes; fails if the line is stuck, or accepts nothing when it is to stop.
fn write(
    writer: &mut (impl Write + ?Sized),
    mut bytes: &[u8],
    stop: &AtomicBool,
) -> io::Result<()> {
    let mut taken = Instant::now();
    while !bytes.is_empty() {
        match writer.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(written) => {
                bytes = bytes.get(written..).unwrap_or_default();
                taken = Instant::now();
            }
            Err(error) if !is_patience(&error) => return Err(error),
            Err(_) if stop.load(Ordering::Relaxed) => {
                return Err(io::Error::other("stopped while the receiver took nothing"));
            }
            Err(_) if taken.elapsed() >= WRITE_TIMEOUT => {
                let seconds = WRITE_TIMEOUT.as_secs();
                let text = format!("the receiver has taken nothing for {seconds} s");
                return Err(io::Error::new(ErrorKind::TimedOut, text));
            }
            Err(_) => (),
        }
    }
    writer.flush()
}

/// Whether the read timed out.
fn is_patience(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// A serial port whose bytes count as sent once the system has accepted them: waiting for the wire has no time limit.
struct Port(SerialPort);

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A UDP socket as a writer: a write is a datagram.
#[derive(Debug)]
pub struct Datagrams(UdpSocket, SharedRefusals);

impl Write for Datagrams {
    fn write(&mut self, packet: &[u8]) -> io::Result<usize> {
        // An error may concern an earlier datagram: there is no receiver yet.
        let lost = |error| self.1.count(error).map(|()| packet.len());
        self.0.send(packet).or_else(lost)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

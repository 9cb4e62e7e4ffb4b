//! A connection to a program that sends OpenIGTLink messages.

use super::exchange::Exchange;
use super::message::{HEADER, Header};
use anyhow::{Result, anyhow, bail};
use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant};

/// Interval of polling the line, and of attempts to connect.
const GLANCE: Duration = Duration::from_millis(20);

/// Pause between two connections if the first brought no message.
const PAUSE: Duration = Duration::from_millis(200);

/// Timeout of a connection attempt.
const CONNECT: Duration = Duration::from_secs(5);

/// A peer that is silent for this long between two messages may be replaced by the next one.
const IDLE: Duration = Duration::from_secs(1);

/// A connection is closed if a message takes longer than this, plus a second for each megabyte.
const STALLED: Duration = Duration::from_secs(5);

/// Bytes per read.
const CHUNK: usize = 1 << 16;

/// The largest body that is skipped: an image.
const LARGEST: u64 = 1 << 30;

/// Where OpenIGTLink messages come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A server, `igtl:HOST:PORT`.
    Server(String),
    /// Any client that connects: `igtl-listen:PORT` from this computer only, or `igtl-listen:HOST:PORT`.
    Listen(String),
}

impl FromStr for Address {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let is_address = |text: &str| {
            let parts = text.rsplit_once(':');
            parts.is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok())
        };
        match text.split_once(':') {
            Some(("igtl", at)) if is_address(at) => Ok(Self::Server(at.to_owned())),
            Some(("igtl-listen", at)) if is_address(at) => Ok(Self::Listen(at.to_owned())),
            Some(("igtl-listen", port)) if port.parse::<u16>().is_ok() => {
                Ok(Self::Listen(format!("127.0.0.1:{port}")))
            }
            _ => Err(()),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Server(at) => write!(f, "igtl:{at}"),
            Self::Listen(at) => write!(f, "igtl-listen:{at}"),
        }
    }
}

/// Makes connections, and makes them again.
pub enum Door {
    Server {
        address: Address,
        at: String,
        patience: Duration,
    },
    /// With a peer that replaces a silent one.
    Listen(TcpListener, Option<TcpStream>),
}

impl Door {
    /// # Errors
    /// If the address cannot be bound.
    pub fn new(address: Address, patience: Duration) -> Result<Self> {
        match &address {
            Address::Server(at) => {
                let at = at.clone();
                Ok(Self::Server { address, at, patience })
            }
            Address::Listen(at) => {
                let listener = TcpListener::bind(at.as_str()).and_then(|listener| {
                    listener.set_nonblocking(true)?;
                    Ok(listener)
                });
                listener
                    .map(|listener| Self::Listen(listener, None))
                    .map_err(|error| anyhow!("{address}: cannot listen there ({error})"))
            }
        }
    }

    /// The next connection: to a server within the user's time limit from `since` on; from a client at any time.
    /// `has_ended` is for the error: whether the server sent messages before.
    pub fn next(&mut self, since: Instant, has_ended: bool) -> Result<Peer> {
        loop {
            let made = match self {
                Self::Listen(listener, waiting) => match waiting.take() {
                    Some(socket) => Ok(socket),
                    None => listener.accept().map(|(socket, _)| socket),
                },
                Self::Server { at, .. } => connect(at.as_str()),
            };
            match (made.and_then(Peer::new), &self) {
                (Ok(peer), _) => return Ok(peer),
                (Err(error), Self::Server { address, patience, .. })
                    if since.elapsed() >= *patience =>
                {
                    let within = format!("within {} s ({error})", patience.as_secs());
                    if has_ended {
                        bail!("{address}: ended, and cannot be reached again {within}");
                    }
                    bail!(
                        "{address}: cannot be reached {within}; is the program that sends frames running?"
                    );
                }
                _ => thread::sleep(GLANCE),
            }
        }
    }

    /// Pauses after a connection that brought no message.
    ///
    /// # Errors
    /// If the server has sent no message for as long as the user allows.
    pub fn pause(&self, since: Instant) -> Result<()> {
        match self {
            Self::Server { address, patience, .. } if since.elapsed() >= *patience => bail!(
                "{address}: connects, but has sent no message within {} s; is it an OpenIGTLink server, and does another \
                 program hold it?",
                patience.as_secs()
            ),
            _ => thread::sleep(PAUSE),
        }
        Ok(())
    }

    /// Accepts the latest of the waiting connections. Returns whether there is one.
    fn is_wanted(&mut self) -> bool {
        if let Self::Listen(listener, waiting) = self {
            while let Ok((socket, _)) = listener.accept() {
                *waiting = Some(socket);
            }
            return waiting.is_some();
        }
        false
    }
}

/// Connects to the first address of a name that answers.
fn connect(at: impl ToSocketAddrs) -> std::io::Result<TcpStream> {
    let mut last = ErrorKind::NotFound.into();
    for address in at.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(socket) => return Ok(socket),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// How a connection ended.
#[derive(Debug, PartialEq)]
pub enum ConnectionEnd {
    /// Between two messages.
    Closed,
    /// Within a message, or at bytes that are not a message.
    Broken(&'static str),
    /// It was silent, and another peer waits.
    Replaced,
}

pub struct Peer {
    socket: TcpStream,
    /// Bytes of a message that the peer has not accepted yet.
    unsent: Vec<u8>,
}

impl Peer {
    fn new(socket: TcpStream) -> std::io::Result<Self> {
        socket.set_nonblocking(false)?;
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(GLANCE))?;
        // A peer that does not read must not block this thread.
        socket.set_write_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self { socket, unsent: Vec::new() })
    }

    /// Waits for a header, and sends statuses in the meantime.
    pub fn header(
        &mut self,
        door: &mut Door,
        exchange: &Exchange,
    ) -> Result<Header, ConnectionEnd> {
        let mut header = [0; HEADER];
        let start = Instant::now();
        let first = loop {
            self.report(exchange);
            match self.socket.read(&mut header) {
                Ok(0) => return Err(ConnectionEnd::Closed),
                Ok(bytes) => break bytes,
                Err(error) if !is_patience(&error) => return Err(ConnectionEnd::Closed),
                Err(_) => (),
            }
            if start.elapsed() >= IDLE && door.is_wanted() {
                return Err(ConnectionEnd::Replaced);
            }
        };
        self.fill(&mut header[first..], Instant::now() + STALLED)?;
        let parsed = Header::parse(&header);
        parsed.ok_or(ConnectionEnd::Broken("no message begins where the one before it ends"))
    }

    /// Reads a body. Memory grows with the received bytes, because the size in a header is only a claim.
    pub fn body(&mut self, size: u64, body: &mut Vec<u8>) -> Result<(), ConnectionEnd> {
        body.clear();
        self.chunks(size, |chunk| body.extend_from_slice(chunk))
    }

    /// Skips a body.
    pub fn skip(&mut self, size: u64) -> Result<(), ConnectionEnd> {
        self.chunks(size, |_| ())
    }

    fn chunks(&mut self, size: u64, mut take: impl FnMut(&[u8])) -> Result<(), ConnectionEnd> {
        if size > LARGEST {
            return Err(ConnectionEnd::Broken("a message states a body of more than a gibibyte"));
        }
        let (mut chunk, mut left) = ([0; CHUNK], size);
        let end = Instant::now() + STALLED + Duration::from_micros(size);
        while left > 0 {
            let now = &mut chunk[..left.min(CHUNK as u64) as usize];
            self.fill(now, end)?;
            take(now);
            left -= now.len() as u64;
        }
        Ok(())
    }

    /// Reads exactly these bytes, until `end` at the latest.
    fn fill(&mut self, mut bytes: &mut [u8], end: Instant) -> Result<(), ConnectionEnd> {
        while !bytes.is_empty() {
            match self.socket.read(bytes) {
                Ok(0) => return Err(ConnectionEnd::Broken("a message was cut short")),
                Ok(read) => bytes = bytes.get_mut(read..).unwrap_or_default(),
                Err(error) if !is_patience(&error) => {
                    return Err(ConnectionEnd::Broken("a message was cut short"));
                }
                Err(_) => (),
            }
            if !bytes.is_empty() && Instant::now() >= end {
                return Err(ConnectionEnd::Broken(
                    "a message stopped in the middle, or comes too slowly",
                ));
            }
        }
        Ok(())
    }

    /// Sends the status that is due, as far as the peer accepts it. A lost connection is noticed when it is read.
    pub fn report(&mut self, exchange: &Exchange) {
        if self.unsent.is_empty() {
            self.unsent = exchange.status_due().unwrap_or_default();
        }
        self.push();
    }

    /// Sends a message, unless the peer has not accepted all of the one before.
    pub fn tell(&mut self, message: Vec<u8>) {
        if self.unsent.is_empty() {
            self.unsent = message;
        }
        self.push();
    }

    fn push(&mut self) {
        if let Ok(sent) = self.socket.write(&self.unsent) {
            self.unsent.drain(..sent);
        }
    }
}

fn is_patience(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::{ConnectionEnd, Peer, connect};
    use std::io::Write;
    use std::net::{SocketAddr, TcpListener, TcpStream};
    use std::thread;
    use std::time::{Duration, Instant};

    fn listener() -> (TcpListener, SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let at = listener.local_addr().expect("an address");
        (listener, at)
    }

    #[test]
    fn the_next_address_of_a_name_is_tried() {
        let (closed, (open, at)) = (listener().1, listener());
        assert!(connect(&[closed][..]).is_err());
        assert_eq!(connect(&[closed, at][..]).and_then(|to| to.peer_addr()).expect("open"), at);
        drop(open);
    }

    /// Neither a peer that stops within a message nor one that sends a byte now and then blocks beyond the time limit.
    #[test]
    fn a_message_has_a_time_to_come() {
        let (listener, at) = listener();
        let mut sender = TcpStream::connect(at).expect("a connection");
        let mut peer = Peer::new(listener.accept().expect("a connection").0).expect("a peer");
        let mut ends = |limit| {
            let start = Instant::now();
            let end = peer.fill(&mut [0; 1000], start + Duration::from_millis(limit));
            assert!(
                matches!(end, Err(ConnectionEnd::Broken(why)) if why.contains("too slowly")),
                "{end:?}"
            );
            start.elapsed()
        };
        sender.write_all(&[0; 999]).expect("room");
        assert!(ends(100) >= Duration::from_millis(100));
        thread::scope(|scope| {
            scope.spawn(|| {
                for _ in 0..100 {
                    sender.write_all(&[0]).expect("room");
                    thread::sleep(Duration::from_millis(10));
                }
            });
            assert!(ends(200) < Duration::from_secs(1));
        });
    }
}

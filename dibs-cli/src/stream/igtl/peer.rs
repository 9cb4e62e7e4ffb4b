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

/// Between two looks at the line, and two attempts to connect.
const GLANCE: Duration = Duration::from_millis(20);

/// Longest time to connect.
const CONNECT: Duration = Duration::from_secs(5);

/// A peer that is silent for so long between two messages gives way to the next one.
const IDLE: Duration = Duration::from_secs(1);

/// And inside of a message is given up.
const STALLED: Duration = Duration::from_secs(5);

/// Bytes that are read at once.
const CHUNK: usize = 1 << 16;

/// The largest body that is passed over: of an image.
const LARGEST: u64 = 1 << 30;

/// Where OpenIGTLink messages come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A server, `igtl:HOST:PORT`.
    Server(String),
    /// Whoever connects, `igtl-listen:PORT` on this computer alone, or `igtl-listen:HOST:PORT`.
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
    Server { address: Address, at: String, patience: Duration },
    Listen(TcpListener),
}

impl Door {
    /// # Errors
    /// If nobody can connect here.
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
                    .map(Self::Listen)
                    .map_err(|error| anyhow!("{address}: cannot listen there ({error})"))
            }
        }
    }

    /// The next connection: of a server within the time that the user allows, of others whenever one comes.
    pub fn next(&self) -> Result<Peer> {
        let start = Instant::now();
        loop {
            let made = match self {
                Self::Listen(listener) => listener.accept().map(|(socket, _)| socket),
                Self::Server { at, .. } => at.to_socket_addrs().and_then(|mut all| {
                    let first = all.next().ok_or(ErrorKind::NotFound)?;
                    TcpStream::connect_timeout(&first, CONNECT)
                }),
            };
            match (made.and_then(Peer::new), self) {
                (Ok(peer), _) => return Ok(peer),
                (Err(error), Self::Server { address, patience, .. })
                    if start.elapsed() >= *patience =>
                {
                    bail!(
                        "{address}: cannot be reached within {} s ({error}); is the program that sends frames running?",
                        patience.as_secs()
                    );
                }
                _ => thread::sleep(GLANCE),
            }
        }
    }

    /// A connection that waits, of whoever connects.
    fn waiting(&self) -> Option<TcpStream> {
        match self {
            Self::Listen(listener) => listener.accept().ok().map(|(socket, _)| socket),
            Self::Server { .. } => None,
        }
    }
}

/// How a connection ended.
#[derive(Debug, PartialEq)]
pub enum Ended {
    /// Between two messages.
    Closed,
    /// Inside of one, or where none is.
    Broken(&'static str),
}

pub struct Peer {
    socket: TcpStream,
    /// Bytes of a status that the peer has not taken yet.
    unsent: Vec<u8>,
}

impl Peer {
    fn new(socket: TcpStream) -> std::io::Result<Self> {
        socket.set_nonblocking(false)?;
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(GLANCE))?;
        // A peer that reads nothing holds nobody up.
        socket.set_write_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self { socket, unsent: Vec::new() })
    }

    /// Waits for a header, and sends statuses meanwhile.
    pub fn header(&mut self, door: &Door, exchange: &Exchange) -> Result<Header, Ended> {
        let mut header = [0; HEADER];
        let mut heard = Instant::now();
        let first = loop {
            self.report(exchange);
            match self.socket.read(&mut header) {
                Ok(0) => return Err(Ended::Closed),
                Ok(bytes) => break bytes,
                Err(error) if !is_patience(&error) => return Err(Ended::Closed),
                Err(_) => (),
            }
            if heard.elapsed() >= IDLE
                && let Some(next) = door.waiting().and_then(|socket| Self::new(socket).ok())
            {
                *self = next;
                heard = Instant::now();
            }
        };
        self.fill(&mut header[first..])?;
        let parsed = Header::parse(&header);
        parsed.ok_or(Ended::Broken("no message begins where the one before it ends"))
    }

    /// Reads a body. The memory grows as its bytes come: a size in a header is only a claim.
    pub fn body(&mut self, size: u64, body: &mut Vec<u8>) -> Result<(), Ended> {
        body.clear();
        self.chunks(size, |chunk| body.extend_from_slice(chunk))
    }

    /// Passes a body over.
    pub fn skip(&mut self, size: u64) -> Result<(), Ended> {
        self.chunks(size, |_| ())
    }

    fn chunks(&mut self, size: u64, mut take: impl FnMut(&[u8])) -> Result<(), Ended> {
        if size > LARGEST {
            return Err(Ended::Broken("a message states a body of more than a gibibyte"));
        }
        let (mut chunk, mut left) = ([0; CHUNK], size);
        while left > 0 {
            let now = &mut chunk[..left.min(CHUNK as u64) as usize];
            self.fill(now)?;
            take(now);
            left -= now.len() as u64;
        }
        Ok(())
    }

    fn fill(&mut self, mut bytes: &mut [u8]) -> Result<(), Ended> {
        let mut heard = Instant::now();
        while !bytes.is_empty() {
            match self.socket.read(bytes) {
                Ok(0) => return Err(Ended::Broken("a message was cut short")),
                Ok(read) => {
                    bytes = bytes.get_mut(read..).unwrap_or_default();
                    heard = Instant::now();
                }
                Err(error) if !is_patience(&error) => {
                    return Err(Ended::Broken("a message was cut short"));
                }
                Err(_) if heard.elapsed() >= STALLED => {
                    return Err(Ended::Broken("a message stopped in the middle"));
                }
                Err(_) => (),
            }
        }
        Ok(())
    }

    /// Sends the status that is due, as far as the peer takes it. A connection that is gone shows when it is read.
    pub fn report(&mut self, exchange: &Exchange) {
        if self.unsent.is_empty() {
            self.unsent = exchange.status_due().unwrap_or_default();
        }
        if let Ok(sent) = self.socket.write(&self.unsent) {
            self.unsent.drain(..sent);
        }
    }
}

fn is_patience(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

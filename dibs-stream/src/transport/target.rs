//! Addresses of receivers: `serial:…`, `tcp:…`, `udp:…`, `unix:…`.

use std::fmt;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use serial2::SerialPort;
use thiserror::Error;

use super::Line;

/// Default of a serial line, in bits a second.
const BAUD: u32 = 115_200;

/// Timeout of a connection attempt.
const CONNECT: Duration = Duration::from_secs(5);

/// A receiver's address.
///
/// ```
/// use dibs_stream::transport::Target;
/// let target: Target = "serial:/dev/ttyUSB0@921600".parse()?;
/// assert_eq!(target.to_string(), "serial:/dev/ttyUSB0@921600");
/// assert!("ttyUSB0".parse::<Target>().is_err());
/// # Ok::<(), dibs_stream::transport::TargetError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Target {
    /// A serial port, `serial:PORT` or `serial:PORT@BAUD`; by default 115,200 baud.
    Serial {
        /// The port: a device file, or `COM3`.
        port: String,
        /// Bits a second.
        baud: u32,
    },
    /// A TCP server, `tcp:HOST:PORT`.
    Tcp(String),
    /// A UDP receiver, `udp:HOST:PORT`, or `udp:HOST:PORT@LOCAL_PORT` if the receiver answers to a fixed port; by
    /// default any free port.
    Udp {
        /// Host and port.
        address: String,
        /// The local port.
        local: u16,
    },
    /// A listening Unix socket, `unix:PATH`.
    Unix(PathBuf),
}

/// A target that cannot be parsed or reached.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TargetError {
    /// Not one of the four kinds.
    #[error(
        "`{text}` is no target: serial:PORT[@BAUD], tcp:HOST:PORT, udp:HOST:PORT[@LOCAL_PORT] or unix:PATH"
    )]
    Kind {
        /// The text given.
        text: String,
    },
    /// A baud rate that is not a positive number.
    #[error("`{text}`: the baud rate `{baud}` is not a positive whole number")]
    Baud {
        /// The text given.
        text: String,
        /// The part after the `@`.
        baud: String,
    },
    /// The target cannot be opened.
    #[error(
        "{target}: cannot be opened ({source}); is the receiver running, and the address right?"
    )]
    Open {
        /// The target.
        target: Target,
        /// The operating system's error.
        source: std::io::Error,
    },
}

impl FromStr for Target {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Self, TargetError> {
        let kind = || TargetError::Kind { text: text.to_owned() };
        let (scheme, rest) = text.split_once(':').ok_or_else(kind)?;
        let address = |rest: &str| {
            let (host, port) = rest.rsplit_once(':').ok_or_else(kind)?;
            let is_address = !host.is_empty() && port.parse::<u16>().is_ok();
            if is_address { Ok(rest.to_owned()) } else { Err(kind()) }
        };
        match scheme {
            _ if rest.is_empty() => Err(kind()),
            "serial" => {
                let (port, baud) = match rest.rsplit_once('@') {
                    None => (rest, BAUD),
                    Some((port, text_of_baud)) => {
                        let baud = text_of_baud.parse().ok().filter(|&baud| baud > 0);
                        let baud = baud.ok_or_else(|| TargetError::Baud {
                            text: text.to_owned(),
                            baud: text_of_baud.to_owned(),
                        })?;
                        (port, baud)
                    }
                };
                Ok(Self::Serial { port: port.to_owned(), baud })
            }
            "tcp" => Ok(Self::Tcp(address(rest)?)),
            "udp" => {
                let (rest, local) = rest.rsplit_once('@').unwrap_or((rest, "0"));
                let local = local.parse().map_err(|_| kind())?;
                Ok(Self::Udp { address: address(rest)?, local })
            }
            "unix" => Ok(Self::Unix(PathBuf::from(rest))),
            _ => Err(kind()),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { port, baud } => write!(f, "serial:{port}@{baud}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Udp { address, local: 0 } => write!(f, "udp:{address}"),
            Self::Udp { address, local } => write!(f, "udp:{address}@{local}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
        }
    }
}

impl Target {
    /// Connects.
    ///
    /// # Errors
    /// [`TargetError::Open`] with the operating system's error.
    pub fn open(&self) -> Result<Line, TargetError> {
        self.connect().map_err(|source| TargetError::Open { target: self.clone(), source })
    }

    fn connect(&self) -> std::io::Result<Line> {
        match self {
            Self::Serial { port, baud } => Line::serial(SerialPort::open(port, *baud)?),
            Self::Tcp(address) => {
                Line::tcp(TcpStream::connect_timeout(&resolve(address)?, CONNECT)?)
            }
            Self::Udp { address, local } => {
                let (peer, local) = (resolve(address)?, *local);
                let any: SocketAddr = if peer.is_ipv4() {
                    ([0, 0, 0, 0], local).into()
                } else {
                    ([0_u16; 8], local).into()
                };
                let socket = UdpSocket::bind(any)?;
                socket.connect(peer)?;
                Line::udp(socket)
            }
            #[cfg(unix)]
            Self::Unix(path) => Line::unix(std::os::unix::net::UnixStream::connect(path)?),
            #[cfg(not(unix))]
            Self::Unix(_) => Err(std::io::Error::other("this system has no Unix sockets")),
        }
    }
}

fn resolve(address: &str) -> std::io::Result<SocketAddr> {
    address
        .to_socket_addrs()?
        .next()
        .ok_or_else(|| std::io::Error::other("the host name has no address"))
}

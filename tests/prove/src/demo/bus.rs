//! The bus between sender and controller: an emulated serial line, or Ethernet.

use std::net::{Ipv4Addr, UdpSocket};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Child;
use std::sync::Arc;

use anyhow::Result;
use controller::{MTU, TICK_RATE, Trust, network};
use dibs_build::Motion;
use dibs_stream::transport::Line;
use glam::Vec3;
use xtask::qemu;

use super::flood::Wire;
use super::sender::{Link, paced};
use super::session::accept;

/// Least frame rate of a sender on Ethernet (1/s): a slower recording is interpolated.
const FRAME_RATE: f32 = 60.0;

/// Bytes in flight to the board's Ethernet controller, whose buffer holds seven large packets.
pub const WINDOW: u32 = 5 * MTU as u32;

/// The kind of bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bus {
    Serial,
    Ethernet,
    /// Ethernet, whose frames come by the program `dibs`.
    Bridge,
}

impl Bus {
    /// The controller's limits on this bus.
    pub const fn trust(self) -> &'static Trust {
        match self {
            Self::Serial => &Trust::SERIAL,
            Self::Ethernet | Self::Bridge => &Trust::ETHERNET,
        }
    }

    /// Ticks in which the controller acknowledges a frame, longer than any check: a frame that is not acknowledged by
    /// then was lost.
    pub const fn answer(self) -> u32 {
        match self {
            Self::Serial => TICK_RATE / 20,
            Self::Ethernet | Self::Bridge => TICK_RATE / 40,
        }
    }

    /// Frames and their rate: over Ethernet at least 60 a second, with interpolated frames between the recorded ones.
    pub fn frames(self, motion: &Motion, rate: f32) -> (Vec<Vec<Vec3>>, f32) {
        let parts = match self {
            Self::Serial => 1,
            Self::Ethernet | Self::Bridge => (FRAME_RATE / rate).ceil().max(1.0) as u32,
        };
        let next = motion.frames.iter().cycle().skip(1);
        let frames = motion.frames.iter().zip(next).flat_map(|(now, next)| {
            (0..parts).map(move |part| {
                let along = part as f32 / parts as f32;
                now.iter().zip(next).map(|(now, next)| now.lerp(*next, along)).collect()
            })
        });
        (frames.collect(), rate * parts as f32)
    }

    /// Opens the bus on which the controller finds its sender.
    pub fn open(self, folder: &Path) -> Result<Opened> {
        match self {
            Self::Serial => {
                let path = folder.join("bus");
                Ok(Opened {
                    socket: Socket::Serial(UnixListener::bind(&path)?),
                    end: qemu::Bus::Serial(path),
                })
            }
            Self::Ethernet | Self::Bridge => {
                // The emulator listens at a port that was free a moment ago.
                let port = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port();
                let backend = format!("user,hostfwd=udp:127.0.0.1:{port}-:{}", network::PORT);
                let socket = match self {
                    Self::Bridge => Socket::Bridge(port),
                    _ => Socket::Ethernet(port),
                };
                Ok(Opened { socket, end: qemu::Bus::Ethernet(backend) })
            }
        }
    }
}

/// A bus whose controller has not started yet.
pub struct Opened {
    socket: Socket,
    pub end: qemu::Bus,
}

enum Socket {
    Serial(UnixListener),
    Ethernet(u16),
    Bridge(u16),
    Wire(Wire),
}

/// What sends frames to the controller.
pub enum Feed {
    /// The demo's own sender, on this line.
    Own(Line),
    /// The program `dibs`, to this port.
    Bridge(u16),
}

impl Opened {
    /// A network on which anybody may send raw frames, and a handle to it.
    pub fn wire() -> Result<(Self, Wire)> {
        let (wire, end) = Wire::new()?;
        let handle = wire.share()?;
        Ok((Self { socket: Socket::Wire(wire), end }, handle))
    }

    /// The sender's end, once the controller has started.
    pub fn connect(self, controller: &mut Child, link: &Arc<Link>) -> Result<Feed> {
        let line = match self.socket {
            Socket::Bridge(port) => return Ok(Feed::Bridge(port)),
            Socket::Serial(listener) => {
                let socket = accept(&listener, controller)?;
                let (reader, handle) = (socket.try_clone()?, socket.try_clone()?);
                // The timeout lets the reading thread check whether it is still needed.
                socket.set_read_timeout(Some(std::time::Duration::from_millis(50)))?;
                let hang_up = move || drop(handle.shutdown(std::net::Shutdown::Both));
                Line::stream(paced(socket, link, 0), reader, hang_up)
            }
            Socket::Wire(wire) => wire.line(link)?,
            Socket::Ethernet(port) => {
                let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
                socket.connect((Ipv4Addr::LOCALHOST, port))?;
                Line::udp_paced(socket, |datagrams| paced(datagrams, link, WINDOW))?
            }
        };
        Ok(Feed::Own(line))
    }
}

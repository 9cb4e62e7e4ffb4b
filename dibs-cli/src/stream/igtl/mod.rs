//! `--from igtl:HOST:PORT`: positions out of OpenIGTLink messages, and the receiver's status back.
//!
//! A message that cannot be used is counted and passed over, and a connection that ends is made again: the receiver's
//! surface ages meanwhile.

mod content;
mod delay;
mod exchange;
mod matching;
mod message;
mod peer;
#[cfg(test)]
mod tests;
mod topology;

pub use exchange::{Exchange, Report};
pub use peer::Address;

use super::live::{Age, Parsed};
use super::place::Place;
use anyhow::Result;
use content::{Content, Kind};
use delay::Delay;
use exchange::Cause;
use message::{BodyError, Header};
use peer::{Door, Ended, Peer};
use std::sync::Arc;
use std::time::{Duration, Instant};
use topology::Topology;

/// A source of frames.
pub struct Igtl {
    name: String,
    door: Door,
    peer: Option<Peer>,
    /// The only device whose positions are taken.
    device: Option<String>,
    place: Place,
    topology: Topology,
    exchange: Arc<Exchange>,
    delay: Delay,
    body: Vec<u8>,
    /// Of the next message with positions, from 0.
    number: usize,
    /// When the last whole message came, or the source was started.
    heard: Instant,
    /// Whether this connection has brought one.
    has_message: bool,
}

/// A message that is refused.
type Refusal = (Cause, String);

impl Igtl {
    /// # Errors
    /// If nobody can connect here.
    pub fn new(
        address: &Address,
        device: Option<String>,
        patience: Duration,
        place: Place,
        exchange: Arc<Exchange>,
    ) -> Result<Self> {
        let topology = Topology::new(place.order.clone());
        let (name, door) = (address.to_string(), Door::new(address.clone(), patience)?);
        let (delay, heard) = (Delay::new(), Instant::now());
        Ok(Self {
            name,
            door,
            peer: None,
            device,
            place,
            topology,
            exchange,
            delay,
            body: Vec::new(),
            number: 0,
            heard,
            has_message: false,
        })
    }

    /// The next frame that fits the tree.
    ///
    /// # Errors
    /// If the server cannot be reached, or brings no message, within the time that the user allows.
    pub fn next(&mut self) -> Result<Option<Parsed>> {
        loop {
            let mut peer = match self.peer.take() {
                Some(peer) => peer,
                None => {
                    let peer = self.door.next(self.heard)?;
                    self.exchange.connected();
                    self.delay = Delay::new();
                    self.topology.forget();
                    self.has_message = false;
                    peer
                }
            };
            match self.message(&mut peer) {
                Ok(parsed) => {
                    self.peer = Some(peer);
                    (self.heard, self.has_message) = (Instant::now(), true);
                    if parsed.is_some() {
                        return Ok(parsed);
                    }
                    continue;
                }
                Err(Ended::Closed) => (),
                Err(Ended::Broken(why)) => self.exchange.broken(format!("{}: {why}", self.name)),
                Err(Ended::Replaced) => {
                    let why = "a peer that was silent gives way to another";
                    self.exchange.tell(format!("{}: {why}", self.name));
                    continue;
                }
            }
            if !self.has_message {
                self.door.pause(self.heard)?;
            }
        }
    }

    /// Reads one message. `None` if it has no frame, or none that fits.
    fn message(&mut self, peer: &mut Peer) -> Result<Option<Parsed>, Ended> {
        let header = peer.header(&mut self.door, &self.exchange)?;
        let other = self.device.as_ref().filter(|device| **device != header.device);
        let kind = Kind::of(&header.kind);
        let Some(kind) = kind.filter(|_| other.is_none()) else {
            let other = other.filter(|_| kind.is_some());
            let note = other.map(|device| {
                let Header { kind, device: theirs, .. } = &header;
                format!(
                    "{}: {kind} of device \"{theirs}\" passed over: --device is {device}",
                    self.name
                )
            });
            peer.skip(header.size)?;
            self.exchange.passed(note);
            return Ok(None);
        };
        let most = self.most();
        let read = if header.size > most {
            peer.skip(header.size)?;
            Err((
                Cause::Layout,
                format!("has {} bytes, and the tree's surface needs at most {most}", header.size),
            ))
        } else {
            let mut body = std::mem::take(&mut self.body);
            let whole = peer.body(header.size, &mut body);
            let came = Instant::now();
            let read = whole.map(|()| self.read(&header, kind, &body, came));
            self.body = body;
            read?
        };
        self.number += 1;
        match read {
            Ok(parsed) => {
                self.exchange.accepted(header.time > 0.0);
                Ok(Some(parsed))
            }
            Err((cause, why)) => {
                let what = format!(
                    "{}, {} of device \"{}\": {why}",
                    self.name, header.kind, header.device
                );
                self.exchange.refused(cause, what);
                peer.report(&self.exchange);
                Ok(None)
            }
        }
    }

    /// Bytes of the largest message of this surface: 256 for a point, with its attributes, and 64 for a triangle.
    fn most(&self) -> u64 {
        let order = &self.place.order;
        (1 << 20) + 256 * order.positions() as u64 + 64 * order.triangles().len() as u64
    }

    fn read(
        &mut self,
        header: &Header,
        kind: Kind,
        body: &[u8],
        came: Instant,
    ) -> Result<Parsed, Refusal> {
        let content = header.content(body).map_err(|error| match error {
            BodyError::Checksum => (Cause::Checksum, "its checksum is wrong".to_owned()),
            BodyError::Layout => {
                (Cause::Layout, "its extended header reaches outside of it".to_owned())
            }
        })?;
        let layout = match kind {
            Kind::Array => "is no array of N times 3 numbers, float32 or float64",
            Kind::PolyData | Kind::Point => {
                "is not as the protocol has it: a list ends early, or too late"
            }
        };
        let Content { mut positions, cells } =
            kind.read(content).ok_or_else(|| (Cause::Layout, layout.to_owned()))?;
        if let Some(cells) = cells {
            let numbering = self.topology.numbering(positions.len(), cells);
            positions = numbering.map_err(|why| (Cause::Topology, why))?.apply(positions);
        } else if self.topology.is_other() {
            let why = "the POLYDATA before it have the points in another order than the mesh's file, and this one has no \
                       triangles that say it: send POLYDATA alone";
            return Err((Cause::Topology, why.to_owned()));
        }
        let positions = self.place.frame(positions, self.number);
        let positions = positions.map_err(|error| (Cause::Frame, error.to_string()))?;
        Ok(Parsed { positions, came, age: Age::Delay(self.delay.of(came, header.time)) })
    }
}

//! `--from igtl:HOST:PORT`: reads positions from OpenIGTLink messages, and returns the receiver's status.
//!
//! A message that cannot be used is counted and skipped, and a connection that ends is made again; meanwhile the
//! receiver's surface ages.

mod content;
mod delay;
mod exchange;
mod matching;
mod message;
mod peer;
mod pose;
#[cfg(test)]
mod tests;
mod tool;
mod topology;

pub use exchange::{Exchange, Report};
pub use peer::Address;
pub use tool::{SentSurface, TrackedTool};

use super::coordinates::SourceCoordinates;
use super::live::ParsedFrame;
use super::part::Part;
use anyhow::Result;
use content::{Content, Kind};
use delay::Delay;
use dibs_build::glam::Vec3;
use dibs_nostd::RigidPose;
use exchange::Cause;
use message::{BodyError, Header};
use peer::{ConnectionEnd, Door, Peer};
use pose::Pose;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tool::Reading;
use topology::Topology;

/// A source of frames.
pub struct Igtl {
    name: String,
    door: Door,
    peer: Option<Peer>,
    /// If given, only this device's positions are accepted.
    device: Option<String>,
    /// If given, the device whose pose every frame gets.
    pose_device: Option<String>,
    /// If given, the tool whose messages are answered.
    tool: Option<TrackedTool>,
    /// Why the last message of the surface was refused.
    surface_refused: Option<Cause>,
    /// The last pose and positions.
    pose: Option<Part<RigidPose>>,
    positions: Option<Part<Vec<Vec3>>>,
    place: SourceCoordinates,
    topology: Topology,
    exchange: Arc<Exchange>,
    delay: Delay,
    body: Vec<u8>,
    /// Number of the next message with positions, from 0.
    number: usize,
    /// Time of the last complete message, of the end of a connection that brought one, or of the start.
    heard: Instant,
    /// Whether a message has arrived on this connection.
    has_message: bool,
    /// Whether any connection brought a message.
    was_heard: bool,
}

/// Largest size of a message with poses: of more than a thousand instruments.
const MOST_POSES: u64 = 1 << 17;

/// A message that is refused.
type Refusal = (Cause, String);

impl Igtl {
    /// # Errors
    /// If the address cannot be bound.
    pub fn new(
        address: &Address,
        [device, pose_device]: [Option<String>; 2],
        tool: Option<TrackedTool>,
        patience: Duration,
        place: SourceCoordinates,
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
            pose_device,
            tool,
            surface_refused: None,
            pose: None,
            positions: None,
            place,
            topology,
            exchange,
            delay,
            body: Vec::new(),
            number: 0,
            heard,
            has_message: false,
            was_heard: false,
        })
    }

    /// The next frame that fits the tree.
    ///
    /// # Errors
    /// If the server cannot be reached, or sends no message, within the time that the user allows.
    pub fn next(&mut self) -> Result<Option<ParsedFrame>> {
        loop {
            let mut peer = match self.peer.take() {
                Some(peer) => peer,
                None => {
                    let peer = self.door.next(self.heard, self.was_heard)?;
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
                    (self.heard, self.has_message, self.was_heard) = (Instant::now(), true, true);
                    if parsed.is_some() {
                        return Ok(parsed);
                    }
                    continue;
                }
                Err(ConnectionEnd::Closed) => (),
                Err(ConnectionEnd::Broken(why)) => {
                    self.exchange.broken(format!("{}: {why}", self.name));
                }
                Err(ConnectionEnd::Replaced) => {
                    let why = "a peer that was silent gives way to another";
                    self.exchange.tell(format!("{}: {why}", self.name));
                    continue;
                }
            }
            if self.has_message {
                // A server that was silent before it ended has the whole time to come back.
                self.heard = Instant::now();
            } else {
                self.door.pause(self.heard)?;
            }
        }
    }

    /// Reads one message. `None` if it contains no frame that fits.
    fn message(&mut self, peer: &mut Peer) -> Result<Option<ParsedFrame>, ConnectionEnd> {
        let header = peer.header(&mut self.door, &self.exchange)?;
        let kind = pose::Kind::of(&header.kind);
        let wanted = |device: Option<&str>| {
            device.is_some_and(|device| kind.is_some_and(|kind| kind.is_of(&header, device)))
        };
        let wanted = self.devices().map(wanted);
        if let Some(kind) = kind.filter(|_| wanted.contains(&true)) {
            self.poses(peer, &header, (kind, wanted))?;
            return Ok(None);
        }
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
        let read = self.body(peer, &header, most, "the tree's surface", |igtl, body| {
            igtl.read(&header, kind, body, Instant::now())
        })?;
        self.number += 1;
        self.surface_refused = read.as_ref().err().map(|(cause, _)| *cause);
        match read {
            Ok(parsed) => {
                self.exchange.accepted(header.time > 0.0);
                Ok(Some(parsed))
            }
            Err(refusal) => {
                self.refuse(peer, &header, refusal);
                Ok(None)
            }
        }
    }

    /// Reads a body of at most `most` bytes, and parses its content. `what` names the content in a refusal.
    fn body<T>(
        &mut self,
        peer: &mut Peer,
        header: &Header,
        most: u64,
        what: &str,
        read: impl FnOnce(&mut Self, &[u8]) -> Result<T, Refusal>,
    ) -> Result<Result<T, Refusal>, ConnectionEnd> {
        if header.size > most {
            peer.skip(header.size)?;
            let why = format!("has {} bytes, and {what} needs at most {most}", header.size);
            return Ok(Err((Cause::Layout, why)));
        }
        let mut body = std::mem::take(&mut self.body);
        let whole = peer.body(header.size, &mut body);
        let read = whole.map(|()| read(self, &body));
        self.body = body;
        read
    }

    fn refuse(&self, peer: &mut Peer, header: &Header, (cause, why): Refusal) {
        let what = format!("{}, {} of device \"{}\": {why}", self.name, header.kind, header.device);
        self.exchange.refused(cause, what);
        peer.report(&self.exchange);
    }

    /// The devices whose poses are read: the surface's, and the tool's.
    fn devices(&self) -> [Option<&str>; 2] {
        [self.pose_device.as_deref(), self.tool.as_ref().map(|tool| &*tool.device)]
    }

    /// Reads a message that may have the pose of the surface, or of the tool, as `wanted` says, and answers about the latter.
    fn poses(
        &mut self,
        peer: &mut Peer,
        header: &Header,
        (kind, wanted): (pose::Kind, [bool; 2]),
    ) -> Result<(), ConnectionEnd> {
        let read = self.body(peer, header, MOST_POSES, "a message with poses", |igtl, body| {
            let content = content(header, body)?;
            let of = |device: Option<&str>| match device {
                Some(device) => kind.pose(content, device),
                None => Ok(None),
            };
            Ok(igtl.devices().map(of))
        })?;
        let came = Instant::now();
        let delay = read.as_ref().map_or(Duration::ZERO, |_| self.delay.of(came, header.time));
        let [surface, tool] = read.unwrap_or_else(|refusal| [Err(refusal.clone()), Err(refusal)]);
        let mut taken = [Ok(false), Ok(false)];
        if wanted[0] {
            taken[0] = self.take_pose(header, surface, (came, delay));
            if let Err((cause, _)) = &taken[0] {
                self.surface_refused = Some(*cause);
            }
        }
        if wanted[1] {
            taken[1] = self.answer(peer, header, tool, (came, delay));
        }
        match taken {
            [Err(refusal), _] | [_, Err(refusal)] => self.refuse(peer, header, refusal),
            [Ok(false), Ok(false)] => self.exchange.passed(None),
            _ => self.exchange.posed(),
        }
        Ok(())
    }

    /// Takes the surface's pose. Returns whether the message has it.
    fn take_pose(
        &mut self,
        header: &Header,
        read: Result<Option<Pose>, Refusal>,
        (came, delay): (Instant, Duration),
    ) -> Result<bool, Refusal> {
        let Some(pose) = read? else { return Ok(false) };
        let placed = self.place.pose(&pose.rotation, pose.shift);
        let value = placed.map_err(|error| (Cause::Pose, error.to_string()))?;
        Part::replace(&mut self.pose, Part { value, time: header.time, came, delay });
        Ok(true)
    }

    /// Answers about the tool, also if its pose is refused. Returns whether the message has it.
    fn answer(
        &mut self,
        peer: &mut Peer,
        header: &Header,
        read: Result<Option<Pose>, Refusal>,
        (came, delay): (Instant, Duration),
    ) -> Result<bool, Refusal> {
        let pose = match &read {
            Ok(None) => return Ok(false),
            Ok(Some(pose)) => Ok(*pose),
            Err((_, why)) => Err(format!("the tool's message: {why}")),
        };
        if let Some(tool) = &mut self.tool {
            let reading = Reading { header, came, delay, pose, refused: self.surface_refused };
            peer.tell(tool.answer(reading, self.exchange.sent(), &self.place));
        }
        read.map(|_| true)
    }

    /// Largest size of a message of this surface: 256 bytes for a point, with its attributes, and 64 for a triangle.
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
    ) -> Result<ParsedFrame, Refusal> {
        let content = content(header, body)?;
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
        let delay = self.delay.of(came, header.time);
        let part = Part { value: positions.clone(), time: header.time, came, delay };
        let age = Part::replace(&mut self.positions, part).age(came);
        let Some(device) = &self.pose_device else {
            return Ok(ParsedFrame { positions, pose: None, came, age });
        };
        let Some(pose) = &self.pose else {
            let why = format!("no pose of device \"{device}\" has come before it");
            return Err((Cause::Pose, why));
        };
        // A frame is as old as its older part.
        let age = age.max(pose.age(came));
        Ok(ParsedFrame { positions, pose: Some(pose.value), came, age })
    }
}

fn content<'b>(header: &Header, body: &'b [u8]) -> Result<&'b [u8], Refusal> {
    header.content(body).map_err(|error| match error {
        BodyError::Checksum => (Cause::Checksum, "its checksum is wrong".to_owned()),
        BodyError::Layout => {
            (Cause::Layout, "its extended header reaches outside of it".to_owned())
        }
    })
}

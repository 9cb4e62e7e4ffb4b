//! The imaging side: encodes frames of a surface as packets, and sends them to a controller.

use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use dibs_build::Unit;
use dibs_build::glam::DVec3;
use dibs_nostd::RigidPose;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{AesCmac, Content, Counters, Event, Mac};
use dibs_stream::transport::{Line, Target, Transport};
use dibs_stream::{self, SendError, SentFrame, Settings, SurfaceOrder, Totals};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::mesh::unit;
use crate::tree::{Tree, of_any_width};
use crate::{bytes, error, invalid, pose};

/// A line; or a collection of packets for a caller who transports them.
enum Outlet {
    Line(Line),
    Packets(Vec<Vec<u8>>),
}

impl Transport for Outlet {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        match self {
            Self::Line(line) => line.send(packet),
            Self::Packets(packets) => packets.send(packet),
        }
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        match self {
            Self::Line(line) => line.receive(),
            Self::Packets(_) => Ok(None),
        }
    }
}

/// A sender with any packet size.
trait AnySender: Send {
    fn send(&mut self, positions: &[Vec3], age: Option<Duration>) -> Result<SentFrame, SendError>;
    fn send_at(
        &mut self,
        positions: &[Vec3],
        pose: RigidPose,
        age: Duration,
    ) -> Result<SentFrame, SendError>;
    fn poll(&mut self) -> Result<(), SendError>;
    fn totals(&self) -> Totals;
    /// Whether frames can be sent.
    fn is_ready(&self) -> bool;
    /// The receiver's counters from its last status.
    fn counters(&self) -> Counters;
    /// Number of frames in flight, and the latest frame that the receiver acknowledged.
    fn way(&self) -> (u32, Option<u32>);
    fn outlet(&mut self) -> &mut Outlet;
}

impl<const MTU: usize, M: Mac + Send> AnySender for dibs_stream::Sender<Outlet, MTU, M> {
    fn send(&mut self, positions: &[Vec3], age: Option<Duration>) -> Result<SentFrame, SendError> {
        match age {
            Some(age) => self.send_captured(positions, age),
            None => self.send(positions),
        }
    }

    fn send_at(
        &mut self,
        positions: &[Vec3],
        pose: RigidPose,
        age: Duration,
    ) -> Result<SentFrame, SendError> {
        self.send_at(positions, pose, age)
    }

    fn poll(&mut self) -> Result<(), SendError> {
        self.poll()
    }

    fn totals(&self) -> Totals {
        *self.totals()
    }

    fn is_ready(&self) -> bool {
        self.is_ready()
    }

    fn counters(&self) -> Counters {
        *self.counters()
    }

    fn way(&self) -> (u32, Option<u32>) {
        (self.in_flight(), self.acknowledged())
    }

    fn outlet(&mut self) -> &mut Outlet {
        self.transport()
    }
}

/// Sends the frames of a moving surface.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Sender {
    sender: Mutex<Box<dyn AnySender>>,
    origin: DVec3,
    unit: Unit,
}

/// `quantised`, `partial`, `whole_every`, `heartbeat` (s), `session`.
type Choices = (bool, Option<f32>, u32, Option<f64>, Option<u32>);

/// `key`, `receiver`, `challenge`: of the packets' tags.
type Tags = ([u8; 16], u32, Option<u64>);

#[pymethods]
impl Sender {
    #[new]
    fn new(
        py: Python<'_>,
        tree: &Tree,
        to: Option<&str>,
        in_unit: Option<&str>,
        mtu: usize,
        choices: Choices,
        tags: Option<Tags>,
    ) -> PyResult<Self> {
        let unit = in_unit.map(unit).transpose()?.unwrap_or_default();
        let order = of_any_width!(tree.0.view(), tree => SurfaceOrder::of(tree));
        let (quantised, partial, whole_every, heartbeat, session) = choices;
        let usual = Settings::default();
        let settings = Settings {
            quantised,
            partial,
            whole_every,
            heartbeat: heartbeat.map(seconds).transpose()?,
            session: session.unwrap_or(usual.session),
            ..usual
        };
        let outlet = match to {
            Some(to) => {
                let target: Target = to.parse().map_err(|error| error::target(&error))?;
                Outlet::Line(py.detach(|| target.open()).map_err(|error| error::target(&error))?)
            }
            None => Outlet::Packets(Vec::new()),
        };
        let sender = match mtu {
            64 => sender_of::<64>(outlet, order, settings, tags),
            1024 => sender_of::<1024>(outlet, order, settings, tags),
            _ => return Err(invalid(format!("mtu is {mtu}; give 64 (CAN-FD) or 1024"))),
        };
        Ok(Self { sender: Mutex::new(sender), origin: tree.0.origin, unit })
    }

    /// Positions, the time since they were so, and the mesh's rotation and shift. Returns the frame's number, kind, rows,
    /// packets, bytes and error.
    #[pyo3(signature = (positions, age, pose))]
    fn send(
        &self,
        py: Python<'_>,
        positions: &[u8],
        age: Option<f64>,
        pose: Option<pose::PoseParts>,
    ) -> PyResult<(u32, &'static str, usize, usize, usize, f32)> {
        let age = age.map(seconds).transpose()?;
        let millimetres = self.unit.millimetres();
        let at = pose.map(|(rotation, shift)| {
            let pose = (rotation, shift.map(|along| along * millimetres));
            let age = age.ok_or_else(|| invalid("age: with a pose it must be given; a source that stopped cannot be told from a mesh that moves as a whole"))?;
            PyResult::Ok((pose::local(pose, self.origin), age))
        });
        let at = at.transpose()?;
        let sent = py.detach(|| {
            let local = |position: DVec3| (position * millimetres - self.origin).as_vec3();
            let positions: Vec<Vec3> = bytes::points(positions).into_iter().map(local).collect();
            match at {
                None => self.lock().send(&positions, age),
                Some(((rotation, shift), age)) => {
                    let pose = RigidPose::new(rotation, shift)?;
                    self.lock().send_at(&positions, pose, age)
                }
            }
        });
        let SentFrame { epoch, content, rows, packets, bytes, error } =
            sent.map_err(|error| error::send(&error))?;
        let content = match content {
            Content::Partial { .. } => "partial",
            _ => "whole",
        };
        Ok((epoch, content, rows, packets, bytes, error))
    }

    fn poll(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.lock().poll()).map_err(|error| error::send(&error))
    }

    fn is_ready(&self) -> bool {
        self.lock().is_ready()
    }

    /// Frames, partial ones, packets, bytes, statuses.
    fn totals(&self) -> [u64; 5] {
        let Totals { frames, partial, packets, bytes, statuses } = self.lock().totals();
        [frames, partial, packets, bytes, statuses]
    }

    /// Each event that the receiver counts, with its count.
    fn events(&self) -> Vec<(&'static str, u32)> {
        let counters = self.lock().counters();
        Event::ALL.into_iter().map(|event| (event.name(), counters.of(event))).collect()
    }

    fn way(&self) -> (u32, Option<u32>) {
        self.lock().way()
    }

    /// The packets since the last call, if there is no line.
    fn packets<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyBytes>>> {
        match self.lock().outlet() {
            Outlet::Packets(packets) => {
                Ok(packets.drain(..).map(|packet| PyBytes::new(py, &packet)).collect())
            }
            Outlet::Line(_) => Err(invalid("the packets were sent; make the sender with to=None")),
        }
    }
}

impl Sender {
    fn lock(&self) -> MutexGuard<'_, Box<dyn AnySender>> {
        self.sender.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A sender without tags, or with tags once the receiver's challenge is known.
fn sender_of<const MTU: usize>(
    outlet: Outlet,
    order: SurfaceOrder,
    settings: Settings,
    tags: Option<Tags>,
) -> Box<dyn AnySender> {
    let Some((key, receiver, challenge)) = tags else {
        return Box::new(dibs_stream::Sender::<_, MTU>::new(outlet, order, settings));
    };
    let keyed_mac = move |challenge| AesCmac::new(&key, receiver, challenge);
    let mut sender = dibs_stream::Sender::<_, MTU, _>::with_mac(outlet, order, settings, keyed_mac);
    if let Some(challenge) = challenge {
        sender.challenge(challenge);
    }
    Box::new(sender)
}

fn seconds(seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| invalid(format!("{seconds} s is no time; give seconds of at least 0")))
}

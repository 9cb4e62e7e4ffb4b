//! A controller's loop: from packets to answers.

use std::sync::atomic::AtomicU32;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::failsafe::LimitError;
use dibs_nostd::filter::FilterError;
use dibs_nostd::guard::{Bus, GuardLimits, Notes, PosedRows, Rows, Vertices};
use dibs_nostd::modes::Modes;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::wire::{Event, NoMac};
use dibs_nostd::{
    Advance, Budget, Buffer, Buffers, Error, Head, Index, Millis, PathKind, Position, Progress,
    ReceiveError, TreeBytes, guard,
};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyByteArray, PyBytes};

use crate::record::push_answer;
use crate::surface::{KeptContacts, List};
use crate::tool::AnyTool;
use crate::tracker::{AdmittedMotion, ContactRows, Filter, listed, motion, named, record};
use crate::tree::{Owned, Tree, View, of_any_width};
use crate::{bytes, error, invalid, pose};

/// Enough for any tree.
const STACK: usize = dibs_nostd::format::MAX_STACK;

/// Room for opened nodes.
const OPENED: usize = 256;

/// Data that the two ends of a loop refer to.
struct Memory {
    tree: Arc<Owned>,
    state: AtomicU32,
    heads: [Head; 3],
    rows: [Vec<Position>; 3],
    notes: Notes<Poses>,
}

impl Memory {
    fn new(tree: Arc<Owned>) -> Self {
        let nodes = of_any_width!(tree.view(), tree => Nodes::of(tree));
        let rows = nodes.map_or(tree.order.len(), |nodes| nodes.count() as usize);
        let positions = || (0..rows).map(|_| Position::new()).collect();
        Self {
            tree,
            state: AtomicU32::new(0),
            heads: [const { Head::new() }; 3],
            rows: [positions(), positions(), positions()],
            notes: Notes::new(),
        }
    }
}

/// The bus's end and the control tick's. Every frame may have a pose; frames without one behave bit for bit as if poses
/// did not exist.
struct Pair<'m, I: Index, R: Rows<Poses = ()>> {
    bus: Bus<'m, 'm, I, NoMac, PosedRows<R>>,
    guard: guard::Guard<'m, 'm, I, STACK, OPENED, PosedRows<R>, OPENED>,
}

type Poses = <PosedRows as Rows>::Poses;

impl<'m, I: Index, R: Rows<Poses = ()>> Pair<'m, I, R> {
    fn new(
        memory: &'m Memory,
        tree: &dibs_nostd::Tree<'m, I>,
        limits: &GuardLimits,
    ) -> Result<Box<Self>, Error> {
        let buffer =
            |number: usize| Buffer { head: &memory.heads[number], rows: &memory.rows[number] };
        let buffers = Buffers::new(&memory.state, [buffer(0), buffer(1)], Some(buffer(2)));
        let (writer, reader) = buffers.ends();
        let (rows, bytes) = (PosedRows::<R>::of(tree)?, TreeBytes::new(memory.tree.bytes()));
        let bus = Bus::new(&memory.notes, writer, (tree, bytes, &rows), limits, NoMac)?;
        let guard = guard::Guard::new(&memory.notes, reader, (tree, bytes, rows), limits)?;
        Ok(Box::new(Self { bus, guard }))
    }
}

/// A pair for either index width, for frames of vertices or of nodes.
enum Ends<'m> {
    Narrow(Box<Pair<'m, u16, Vertices>>),
    Wide(Box<Pair<'m, u32, Vertices>>),
    NarrowNodes(Box<Pair<'m, u16, Nodes<'static>>>),
    WideNodes(Box<Pair<'m, u32, Nodes<'static>>>),
}

self_cell::self_cell!(
    struct Loop {
        owner: Memory,
        #[not_covariant]
        dependent: Ends,
    }
);

/// Evaluates `$body` with the ends of any kind.
macro_rules! with_ends {
    ($guard:expr, $pair:ident => $body:expr) => {
        $guard.lock().with_dependent_mut(|_, ends| match ends {
            Ends::Narrow($pair) => $body,
            Ends::Wide($pair) => $body,
            Ends::NarrowNodes($pair) => $body,
            Ends::WideNodes($pair) => $body,
        })
    };
}

/// A loop's two ends.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Guard {
    both: Mutex<Loop>,
    contacts: Mutex<Box<List>>,
    tree: Arc<Owned>,
}

impl Guard {
    fn lock(&self) -> MutexGuard<'_, Loop> {
        self.both.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Guard {
    /// `choices`: `automatic`, `without_transit`.
    #[new]
    fn new(
        tree: &Tree,
        speed: f32,
        age: u32,
        ticks: u32,
        choices: (bool, bool),
        budget: u32,
    ) -> PyResult<Self> {
        let (is_automatic, is_without_transit) = choices;
        let limits =
            GuardLimits::new(speed, Millis(age)).ticks_a_second(ticks).budget(Budget::new(budget));
        let limits = if is_automatic { limits.automatic() } else { limits };
        let limits = if is_without_transit { limits.without_transit() } else { limits };
        let both = Loop::try_new(Memory::new(Arc::clone(&tree.0)), |memory| {
            Ok(match memory.tree.view() {
                View::Narrow(tree) if tree.paths() == PathKind::Volume => {
                    Ends::NarrowNodes(Pair::new(memory, tree, &limits)?)
                }
                View::Wide(tree) if tree.paths() == PathKind::Volume => {
                    Ends::WideNodes(Pair::new(memory, tree, &limits)?)
                }
                View::Narrow(tree) => Ends::Narrow(Pair::new(memory, tree, &limits)?),
                View::Wide(tree) => Ends::Wide(Pair::new(memory, tree, &limits)?),
            })
        });
        let (both, contacts) = (Mutex::new(both.map_err(start_error)?), Mutex::default());
        Ok(Self { both, contacts, tree: Arc::clone(&tree.0) })
    }

    fn receive(&self, py: Python<'_>, bytes: &[u8], now: u32) {
        py.detach(|| with_ends!(self, pair => pair.bus.receive(bytes, Millis(now))));
    }

    fn packet(&self, py: Python<'_>, packet: &[u8], now: u32) -> PyResult<&'static str> {
        let outcome = py.detach(|| with_ends!(self, pair => pair.bus.packet(packet, Millis(now))));
        Ok(match outcome.map_err(invalid)? {
            Progress::Begun { .. } => "begun",
            Progress::Duplicate => "duplicate",
            Progress::Complete { .. } => "complete",
            Progress::Heartbeat => "heartbeat",
            Progress::Hello => "hello",
            _ => "stored",
        })
    }

    /// Positions in the mesh's order, their time of capture, and the mesh's rotation and translation.
    #[pyo3(signature = (positions, pose, captured, now))]
    fn frame(
        &self,
        py: Python<'_>,
        positions: &[u8],
        pose: Option<pose::PoseParts>,
        captured: u32,
        now: u32,
    ) -> PyResult<()> {
        let (origin, captured, now) = (self.tree.origin, Millis(captured), Millis(now));
        let pose = pose.map(|pose| pose::local(pose, origin));
        let outcome = py.detach(|| {
            let local = |position: DVec3| (position - origin).as_vec3();
            let positions: Vec<Vec3> = bytes::points(positions).into_iter().map(local).collect();
            with_ends!(self, pair => match pose {
                Some(pose) => pair.bus.frame_at(&positions, pose, captured, now),
                None => pair.bus.frame(&positions, captured, now),
            })
        });
        outcome.map(|_| ()).map_err(invalid)
    }

    /// Weights of the tree's modes, their time of capture, and the mesh's rotation and translation.
    #[pyo3(signature = (weights, pose, captured, now))]
    fn weights(
        &self,
        py: Python<'_>,
        weights: &[u8],
        pose: Option<pose::PoseParts>,
        captured: u32,
        now: u32,
    ) -> PyResult<()> {
        let (captured, now) = (Millis(captured), Millis(now));
        let pose = pose.map(|pose| pose::local(pose, self.tree.origin));
        let modes = of_any_width!(self.tree.view(), tree => Modes::of(tree)).map_err(invalid)?;
        let weights: Vec<f32> =
            bytes::doubles(weights).into_iter().map(|each| each as f32).collect();
        let outcome = py.detach(|| {
            with_ends!(self, pair => match pose {
                Some(pose) => pair.bus.frame_of_weights_at(&modes, &weights, pose, captured, now),
                None => pair.bus.frame_of_weights(&modes, &weights, captured, now),
            })
        });
        outcome.map(|_| ()).map_err(|error| invalid(of_weights(&modes, &weights, &error)))
    }

    fn work(&self, py: Python<'_>, most: u32) -> PyResult<&'static str> {
        let outcome = py.detach(|| with_ends!(self, pair => pair.bus.work(most)));
        Ok(match outcome.map_err(invalid)? {
            Advance::Pending => "pending",
            Advance::Held { .. } => "held",
            Advance::Published { .. } => "published",
            _ => "idle",
        })
    }

    fn status<'py>(
        &self,
        py: Python<'py>,
        now: u32,
        is_framed: bool,
    ) -> Option<Bound<'py, PyBytes>> {
        const PACKET: usize = Bus::<'_, '_, u16>::STATUS_BYTES;
        const LINE: usize = Bus::<'_, '_, u16>::STATUS_FRAMED;
        let (mut packet, mut line) = ([0; PACKET], [0; LINE]);
        let (now, packet, line) = (Millis(now), &mut packet, &mut line);
        let status = with_ends!(self, pair => if is_framed {
            pair.bus.status_framed(now, line)
        } else {
            pair.bus.status(now, packet)
        });
        status.map(|status| PyBytes::new(py, status))
    }

    /// Each event with its count since the start.
    fn counters(&self) -> Vec<(&'static str, u32)> {
        let counters = with_ends!(self, pair => *pair.bus.counters());
        Event::ALL.into_iter().map(|event| (event.name(), counters.of(event))).collect()
    }

    fn register(&self) {
        with_ends!(self, pair => pair.bus.register());
    }

    /// The answer for a tool's numbers; `None` stands for a tool without a pose.
    fn closest(&self, py: Python<'_>, tool: Option<&[u8]>, now: u32) -> PyResult<Answer> {
        let (origin, now) = (self.tree.origin, Millis(now));
        let tool = tool.map(|tool| AnyTool::of(&bytes::doubles(tool), origin)).transpose();
        let tool = tool.map_err(|error| invalid(format!("tool: {error}")))?;
        let answer = py.detach(|| {
            with_ends!(self, pair => match &tool {
                Some(AnyTool::Sphere(sphere)) => pair.guard.closest(sphere, now),
                Some(AnyTool::Capsule(capsule)) => pair.guard.closest(capsule, now),
                None => pair.guard.without_pose(now),
            })
        });
        Ok(Answer { answer, contacts: None, tree: Arc::clone(&self.tree) })
    }

    /// The answer, and the contacts within a margin.
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        tool: &[u8],
        margin: f32,
        now: u32,
    ) -> PyResult<(Answer, ContactRows<'py>)> {
        let (origin, now) = (self.tree.origin, Millis(now));
        let tool = AnyTool::of(&bytes::doubles(tool), origin);
        let tool = tool.map_err(|error| invalid(format!("tool: {error}")))?;
        // While a thread waits for the list, it releases Python, so that the thread that holds the list can return.
        let list = self.contacts.lock_py_attached(py);
        let mut list = list.unwrap_or_else(PoisonError::into_inner);
        let contacts = &mut **list;
        let answer = py.detach(|| {
            with_ends!(self, pair => match &tool {
                AnyTool::Sphere(sphere) => pair.guard.contacts(sphere, margin, now, contacts),
                AnyTool::Capsule(capsule) => pair.guard.contacts(capsule, margin, now, contacts),
            })
        });
        let kept = Some(Box::new(contacts.without_search()));
        let listed = listed(py, contacts, &self.tree);
        Ok((Answer { answer, contacts: kept, tree: Arc::clone(&self.tree) }, listed))
    }

    /// The answer, and the motion that a filter admits; `None` if no surface is trusted.
    fn admit(
        &self,
        py: Python<'_>,
        filter: &Filter,
        tool: &[u8],
        command: [[f64; 3]; 3],
        now: u32,
    ) -> PyResult<(Answer, Option<AdmittedMotion>)> {
        let (origin, now) = (self.tree.origin, Millis(now));
        let tool = AnyTool::of(&bytes::doubles(tool), origin);
        let tool = tool.map_err(|error| invalid(format!("tool: {error}")))?;
        let (filter, command) = (filter.filter(), motion(command, origin));
        let (answer, admitted) = py.detach(|| {
            with_ends!(self, pair => match &tool {
                AnyTool::Sphere(sphere) => pair.guard.admit(filter, sphere, &command, now),
                AnyTool::Capsule(capsule) => pair.guard.admit(filter, capsule, &command, now),
            })
        });
        let admitted = match admitted {
            Ok(admitted) => Some(record(admitted)),
            Err(FilterError::Untrusted(_)) => None,
            Err(error) => return Err(named(error)),
        };
        Ok((Answer { answer, contacts: None, tree: Arc::clone(&self.tree) }, admitted))
    }

    fn acknowledge(&self) -> PyResult<()> {
        with_ends!(self, pair => pair.guard.acknowledge()).map_err(invalid)
    }
}

/// Why weights are refused: in the words of their check, unless it is for another cause.
fn of_weights(modes: &Modes<'_>, weights: &[f32], error: &ReceiveError) -> String {
    modes.check(weights).map_or_else(|error| error.to_string(), |()| error.to_string())
}

/// A sentence with the names of Python's arguments.
fn start_error(error: Error) -> PyErr {
    match error {
        Error::Limit(LimitError::NoReach) => {
            invalid("tree: it has no rest shape, from which its reach follows; build it again")
        }
        Error::Limit(LimitError::Rate) => invalid(format!("ticks_a_second: {error}")),
        Error::Limit(LimitError::Speed { .. }) => {
            invalid(format!("speed_mm_per_s: {error}; give a number of at least 0"))
        }
        Error::Limit(_) => invalid(format!("age_ms: {error}")),
        _ => invalid(format!("tree: {error}")),
    }
}

/// A tick's answer.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Answer {
    pub answer: guard::Answer,
    pub contacts: Option<Box<KeptContacts>>,
    pub tree: Arc<Owned>,
}

#[pymethods]
impl Answer {
    /// The record of the pair to act on.
    fn closest<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyByteArray>> {
        let pair = self.answer.closest.ok()?;
        let mut record = Vec::new();
        push_answer(&mut record, &pair, &self.tree, [0, 0]);
        Some(PyByteArray::new(py, &record))
    }

    /// Why there is no pair to act on.
    fn reason(&self) -> Option<String> {
        self.answer.closest.err().map(error::sentence)
    }

    fn velocity(&self) -> [f32; 3] {
        self.answer.velocity.to_array()
    }

    /// State, cause, margin, and whether only an acknowledgement is missing.
    fn trust(&self) -> (u8, Option<String>, f32, bool) {
        let trust = &self.answer.trust;
        let cause = trust.cause.map(error::sentence);
        (trust.state as u8, cause, trust.margin, trust.waits_for_acknowledgement)
    }

    /// Whether the pair's side is the last tick's.
    fn is_kept(&self) -> bool {
        self.answer.tracked.is_ok_and(|tracked| tracked.is_kept)
    }

    /// Number, age (ms) and lag (ms) of the surface that was searched.
    fn searched(&self) -> Option<(u32, u32, Option<u32>)> {
        let searched = self.answer.searched?;
        Some((searched.frame.epoch, searched.frame.age.0, searched.lag.map(|lag| lag.0)))
    }
}

//! The control tick: pose, query, force, record.

use core::fmt;

use bytemuck::Zeroable;
use dibs_nostd::constraint::{ConstraintForce, ForbiddenRegion, GainError, SpringDamper, Unknown};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Options, Proximity, QueryError, Tool};

use crate::surface::{SURFACE, SurfaceQuery, SurfaceReader};
use crate::telemetry::{State, Tick};
use crate::{BusStatus, TICK_RATE, instrument};

/// A surface older than this many ticks is a fault: the output is safe until a fresh one comes.
///
/// Six seconds, because the emulated serial line takes one to three for a frame, and a frame is as old
/// as its first packet. A real bus brings tens of frames a second, and a real limit is a few tens of
/// milliseconds.
pub const SURFACE_AGE_LIMIT: u32 = 6 * TICK_RATE;

/// Stiffness (N/mm), damping (N s/mm), largest force (N) and margin (mm) of the constraint.
const STIFFNESS: f32 = 1.0;
const DAMPING: f32 = 0.002;
const MAX_FORCE: f32 = 5.0;
const MARGIN: f32 = 5.0;

/// The controller's state from tick to tick.
pub struct Control {
    query: SurfaceQuery,
    surface: SurfaceReader,
    wall: ForbiddenRegion,
    bus: &'static BusStatus,
    tick: u32,
    /// The last tick's closest triangle: where the next query starts.
    warm_start: Option<u32>,
    /// The last tick's instrument, for its velocity.
    before: Option<Capsule>,
}

impl Control {
    /// A controller that reads the surface published through `surface`.
    ///
    /// # Errors
    /// [`SetupError`] when a constant above is out of range, or the query's stack too small.
    pub fn new(surface: SurfaceReader, bus: &'static BusStatus) -> Result<Self, SetupError> {
        let spring = SpringDamper::new(STIFFNESS, DAMPING, MAX_FORCE).map_err(SetupError::Gain)?;
        Ok(Self {
            query: SurfaceQuery::new(&SURFACE).map_err(SetupError::Query)?,
            surface,
            wall: ForbiddenRegion::new(spring, MARGIN).map_err(SetupError::Gain)?,
            bus,
            tick: 0,
            warm_start: None,
            before: None,
        })
    }

    /// Number of the next tick.
    #[must_use]
    pub fn now(&self) -> u32 {
        self.tick
    }

    /// Runs one tick. `clock` is any free-running counter; it only measures what the query takes.
    pub fn tick(&mut self, clock: impl Fn() -> u32) -> Tick {
        let mut record = Tick { kind: Tick::KIND, tick: self.tick, ..Tick::zeroed() };
        record.triangle = u32::MAX;
        record.packets = self.bus.packets();
        record.frames_published = self.bus.published();
        record.rejected = self.bus.rejected();

        let (state, force) = match instrument(self.tick) {
            Ok(tool) => self.act(&tool, clock, &mut record),
            // A pose that is not finite: there is no velocity to damp either.
            Err(_) => (State::Fault, self.wall.force(Err(Unknown::NotFinite), Vec3::NAN)),
        };
        record.state = state as u32;
        record.force = force.force.to_array();
        self.tick = self.tick.wrapping_add(1);
        record
    }

    fn act(
        &mut self,
        tool: &Capsule,
        clock: impl Fn() -> u32,
        record: &mut Tick,
    ) -> (State, ConstraintForce) {
        record.tool_start = tool.start().to_array();
        record.tool_end = tool.end().to_array();
        record.tool_radius = tool.radius();
        let before = self.before.replace(*tool).unwrap_or(*tool);

        let Some(frame) = self.surface.read() else {
            let velocity = velocity(&before, tool, 0.5);
            return (State::Waiting, self.wall.force(Err(Unknown::NoSurface), velocity));
        };
        let label = frame.label();
        let age = frame.age(self.tick);
        record.epoch = label.epoch;
        record.age = age;
        record.position_error = label.position_error;

        let mut options = Options::new().warm_start(self.warm_start);
        if let Some(measured) = label.stretch {
            options = options.stretch(measured);
        }
        let start = clock();
        let answer = self.query.closest(&frame, tool, &options);
        record.query_counts = clock().wrapping_sub(start);
        drop(frame);

        let Ok(closest) = answer else {
            let velocity = velocity(&before, tool, 0.5);
            return (State::Fault, self.wall.force(Err(Unknown::Query), velocity));
        };
        self.warm_start = closest.triangle;
        write(&closest, record);
        let velocity = velocity(&before, tool, closest.axis_parameter);
        if age > SURFACE_AGE_LIMIT {
            (State::Stale, self.wall.force(Err(Unknown::Stale { age }), velocity))
        } else {
            let cautious = closest.widened(label.position_error);
            (State::Tracking, self.wall.force(Ok(&cautious), velocity))
        }
    }
}

/// Velocity of the point at `along` (0 to 1) of the instrument's axis, in mm/s.
fn velocity(before: &Capsule, now: &Capsule, along: f32) -> Vec3 {
    let start = now.start() - before.start();
    let end = now.end() - before.end();
    (start + (end - start) * along) * TICK_RATE as f32
}

fn write(answer: &Proximity, record: &mut Tick) {
    record.separation = answer.separation;
    record.lower = answer.lower;
    record.accuracy = answer.accuracy;
    record.point_on_surface = answer.point_on_surface.to_array();
    record.triangle = answer.triangle.unwrap_or(u32::MAX);
    record.node_tests = answer.node_tests;
    record.triangle_tests = answer.triangle_tests;
}

/// Why a controller cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SetupError {
    /// A gain of the constraint is out of range.
    Gain(GainError),
    /// The query cannot search the tree.
    Query(QueryError),
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gain(error) => error.fmt(f),
            Self::Query(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SetupError {}

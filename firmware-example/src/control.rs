//! The control tick: pose, query, force, record.

use core::fmt;

use bytemuck::Zeroable;
use dibs_nostd::constraint::{ForbiddenRegion, GainError, LastSide, SpringDamper};
use dibs_nostd::failsafe::{FailSafe, LimitError, Observation};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, Capsule, Cost, FrameAge, Millis, Options, Proximity, QueryError, Ticks, Tool,
    Unavailable, VertexTable,
};

use crate::surface::{self, TREE};
#[cfg(not(feature = "wide"))]
use crate::telemetry::fallback_code;
use crate::telemetry::{Tick, cause_code};
use crate::{BusStatus, TICK_RATE, Trust, instrument, time_of};

/// The budget of a query: more than the closest pair on the heart needs, and within a tick on every admitted surface. It
/// is less than [`Cost`] would allow, because a position of a moving surface is a sum of two.
pub const BUDGET: Budget = Budget { node_tests: 1_500, triangle_tests: 120 };

/// How exactly the depth of a crossing axis is found, in mm: the spring tells a quarter of a newton apart, and few depths
/// take more than the budget.
const DEPTH_TOLERANCE: f32 = 0.25;

/// The deadline of a tick in instructions: 1 ms at 480 MHz, with one cycle for each.
pub const TICK_INSTRUCTIONS: u64 = 480_000;

// The rest of the tick takes some thousand instructions.
const _: () = assert!(Cost::M7_CAPSULE.instructions(BUDGET) < TICK_INSTRUCTIONS);

/// Stiffness of the constraint, in N/mm.
pub const STIFFNESS: f32 = 1.0;

/// Its damping, in N s/mm.
pub const DAMPING: f32 = 0.002;

/// Its largest force, in N.
pub const MAX_FORCE: f32 = 5.0;

/// How far it reaches from the surface, in mm.
pub const MARGIN: f32 = 5.0;

/// A search that keeps what it found from tick to tick, with room for so many opened nodes.
#[cfg(not(feature = "wide"))]
type Search = surface::Tracker<256>;

/// A search from the root at every tick, to show that the wide one has no panic path either.
#[cfg(feature = "wide")]
type Search = surface::Query;

/// The controller's state from tick to tick.
pub struct Control {
    search: Search,
    surface: surface::continuous::Reader,
    wall: ForbiddenRegion,
    /// For ticks whose answer has no side.
    last_side: LastSide,
    failsafe: FailSafe,
    bus: &'static BusStatus,
    tick: Ticks,
    /// The last tick's instrument, for its velocity.
    before: Option<Capsule>,
}

impl Control {
    /// A controller that searches `tree` with the surface published through `surface`, and trusts it as far as `trust`.
    ///
    /// # Errors
    /// [`SetupError`] when a constant above is out of range, or the query's stack too small.
    pub fn new(
        tree: &surface::Tree,
        surface: surface::continuous::Reader,
        bus: &'static BusStatus,
        trust: &Trust,
    ) -> Result<Self, SetupError> {
        let spring = SpringDamper::stiffness(STIFFNESS).damping(DAMPING).max_force(MAX_FORCE);
        Ok(Self {
            search: Search::new(tree).map_err(SetupError::Query)?,
            surface,
            wall: ForbiddenRegion::new(spring, MARGIN).map_err(SetupError::Gain)?,
            last_side: LastSide::new(),
            failsafe: FailSafe::new(trust.limits().map_err(SetupError::Limit)?),
            bus,
            tick: Ticks(0),
            before: None,
        })
    }

    /// The time of the next tick.
    #[must_use]
    pub const fn now(&self) -> Millis {
        time_of(self.tick)
    }

    /// Skips ticks, so that a test reaches a pose at once.
    pub const fn skip(&mut self, ticks: Ticks) {
        self.tick = self.tick.after(ticks);
    }

    /// Runs one tick. `clock` is any free-running counter; it only measures the query.
    pub fn tick(&mut self, clock: impl Fn() -> u32) -> Tick {
        let (tick, now) = (self.tick.0 as u32, time_of(self.tick));
        let mut record = Tick { kind: Tick::KIND, tick, ..Tick::zeroed() };
        record.triangle = u32::MAX;
        record.shown_error = -1.0;
        record.bytes = self.bus.bytes();
        record.frames_published = self.bus.published();
        record.rejected = self.bus.rejected();

        let tool = instrument(tick).ok();
        let before = self.before;
        self.before = tool;
        let Asked { age: frame, lag, answer, moved } = match &tool {
            Some(tool) => self.ask(tool, now, clock, &mut record),
            // The pose is not finite, so no query is possible.
            None => {
                Asked { age: None, lag: None, answer: Err(Unavailable::NotFinite), moved: None }
            }
        };
        let link = self.bus.link.read(now);
        let verdict = self.failsafe.step(&Observation {
            frame,
            lag,
            link,
            query_error: match answer {
                Err(Unavailable::Query(error)) => Some(error),
                _ => None,
            },
            is_tree_corrupt: self.bus.is_tree_corrupt()
                || self.search.tree().check(TREE.bytes()).is_err(),
        });
        self.bus.set_state(verdict.state);
        let admitted = answer.and_then(|closest| verdict.admit(closest));
        let settled = self.last_side.settle(admitted, moved);
        let along = answer.map_or(0.5, |closest| closest.axis_parameter);
        let velocity = match (before, tool) {
            (Some(before), Some(now)) => velocity(&before, &now, along),
            (None, Some(_)) => Vec3::ZERO,
            // Without a pose there is no velocity to damp.
            (_, None) => Vec3::NAN,
        };
        let force = self.wall.force(&settled, velocity);

        record.state = verdict.state as u32;
        record.cause = verdict.cause.map_or(0, |cause| cause_code(&cause));
        record.margin = verdict.margin;
        record.silence = link.silence.0;
        (record.read_epoch, record.read_digest) = self.bus.fingerprint();
        record.force = force.force.to_array();
        self.tick = self.tick.after(Ticks(1));
        record
    }

    /// The closest pair on the surface as it has moved on from the frame published last, and that frame's age.
    fn ask(
        &mut self,
        tool: &Capsule,
        now: Millis,
        clock: impl Fn() -> u32,
        record: &mut Tick,
    ) -> Asked {
        record.tool_start = tool.start().to_array();
        record.tool_end = tool.end().to_array();
        record.tool_radius = tool.radius();
        let latest = self.surface.latest(now);
        let age = latest.frame();
        // The fail-safe machine decides how old a surface may be.
        let frame = match latest.of_any_age() {
            Ok(frame) => frame,
            Err(unavailable) => {
                return Asked { age, lag: None, answer: Err(unavailable), moved: None };
            }
        };
        let label = frame.label();
        record.epoch = label.epoch;
        record.age = age.map_or(u32::MAX, |age| age.age.0);
        let surface = frame.extrapolated();
        record.epoch_before = surface.before().epoch().unwrap_or(label.epoch);
        record.share = surface.share();
        record.shown_error = surface.shown_error().unwrap_or(-1.0);
        record.position_error = surface.position_error();
        let lag = surface.lag();

        let options = Options::new().budget(BUDGET).depth_tolerance(DEPTH_TOLERANCE);
        let start = clock();
        #[cfg(not(feature = "wide"))]
        let answer = self.search.closest(&surface, tool, &options).map(|tracked| {
            record.front = tracked.opened;
            record.fallback = fallback_code(tracked.fallback);
            (tracked.closest, tracked.moved)
        });
        #[cfg(feature = "wide")]
        let answer = self.search.closest_wide(&surface, tool, &options).map(|found| (found, None));
        record.query_counts = clock().wrapping_sub(start);
        drop(frame);

        match answer {
            Ok((closest, moved)) => {
                write(&closest, record);
                Asked { age, lag, answer: Ok(closest), moved }
            }
            Err(error) => Asked { age, lag, answer: Err(Unavailable::Query(error)), moved: None },
        }
    }
}

/// What a tick asked for.
struct Asked {
    /// Of the frame published last.
    age: Option<FrameAge>,
    /// The part of the age that the answer's accuracy does not cover.
    lag: Option<Millis>,
    answer: Result<Proximity, Unavailable>,
    /// Most (mm) that tool and surface have moved since the tick before, where it is known.
    moved: Option<f32>,
}

/// Velocity of the point at `along` (0 to 1) of the instrument's axis, in mm/s.
fn velocity(before: &Capsule, now: &Capsule, along: f32) -> Vec3 {
    let start = now.start() - before.start();
    let end = now.end() - before.end();
    (start + (end - start) * along) * TICK_RATE as f32
}

fn write(answer: &Proximity, record: &mut Tick) {
    record.answered = 1;
    record.separation = answer.separation;
    record.lower = answer.lower;
    record.accuracy = answer.accuracy;
    record.point_on_surface = answer.point_on_surface.to_array();
    record.triangle = answer.triangle.map_or(u32::MAX, |triangle| triangle.0);
    record.node_tests = answer.node_tests;
    record.triangle_tests = answer.triangle_tests;
}

/// Why a controller cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SetupError {
    /// A gain of the constraint is out of range.
    Gain(GainError),
    /// A limit of the fail-safe machine is out of range.
    Limit(LimitError),
    /// The query cannot search the tree.
    Query(QueryError),
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gain(error) => error.fmt(f),
            Self::Limit(error) => error.fmt(f),
            Self::Query(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for SetupError {}

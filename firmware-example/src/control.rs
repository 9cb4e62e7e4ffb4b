//! The control tick: pose, answer, force, record.

// Requirement: P-05

use bytemuck::Zeroable;
use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use dibs_nostd::filter::Filter;
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Answer, GuardLimits};
use dibs_nostd::{Capsule, Contacts, Error, Millis, Options, Proximity, Ticks, Tool};

use crate::surface;
use crate::telemetry::{Push, Tick, cause_code, fallback_code};
use crate::{BusStatus, Receiver, Robot, TICK_RATE, Trust, time_of};

/// Instructions for a tick's closest pair, side, depth and contacts. On frames chosen to be expensive the whole tick
/// stays below 120,000 (docs/evidence/guarantees.md). Where nodes carry the surface, the same tests take more. If the
/// budget ends a search, the last tick's bounds stay valid.
#[must_use]
pub const fn instructions(has_nodes: bool) -> u32 {
    if has_nodes { 200_000 } else { 80_000 }
}

/// How exactly the depth of a crossing axis is found, in mm: this changes the spring's force by a quarter of a newton,
/// and few depths exceed the budget.
const DEPTH_TOLERANCE: f32 = 0.25;

/// The deadline of a tick in instructions: 1 ms at 480 MHz, with one cycle for each.
pub const TICK_INSTRUCTIONS: u64 = 480_000;

// The rest of the tick takes some thousand instructions.
const _: () = assert!((instructions(true) as u64) < TICK_INSTRUCTIONS);

/// Stiffness of the constraint, in N/mm.
pub const STIFFNESS: f32 = 1.0;

/// Damping of the constraint, in N s/mm.
pub const DAMPING: f32 = 0.002;

/// Largest force of the constraint, in N.
pub const MAX_FORCE: f32 = 5.0;

/// The constraint's spring.
pub const SPRING: SpringDamper =
    SpringDamper::stiffness(STIFFNESS).damping(DAMPING).max_force(MAX_FORCE);

/// Distance from the surface at which the constraint begins and contacts are listed, in mm.
pub const MARGIN: f32 = 5.0;

/// The contacts of a tick.
pub type ContactList = Contacts<16>;

/// Room for nodes that the search for contacts opened; none without contacts.
const RANGE: usize = if cfg!(feature = "contacts") { 256 } else { 0 };

/// Distance that a filter keeps a commanded instrument from the surface, in mm.
pub const STAND_OFF: f32 = 0.5;

/// The robot's largest speed, in mm/s.
const ROBOT_SPEED: f32 = 300.0;

/// Time constant, in s, of the approach to the stand-off: about a frame's period, so that a new frame does not make the
/// instrument jump.
const APPROACH: f32 = 0.02;

/// Limit on a vertex's speed, in mm/s: twice the generated heart's largest speed in real time, 1.57 mm in a thirtieth
/// of a second. Over the emulated serial line it beats in slow motion, over Ethernet in real time.
pub const SPEED: f32 = 100.0;

/// The controller's two ends of a surface, on a bus with these limits of trust. The list is the caller's, so that it is
/// never moved over a stack.
///
/// # Errors
/// [`Error`] if the tree is damaged, a constant above is out of range, or the surface was started before.
#[inline(always)]
pub fn start<R: Robot>(
    surface: &'static surface::Surface,
    bus: &'static BusStatus,
    trust: &Trust,
    robot: R,
    contacts: &'static mut ContactList,
) -> Result<(Receiver, Control<R>), Error> {
    let limits = GuardLimits::new(SPEED, Millis(trust.age.1))
        .instructions(instructions(cfg!(nodes)))
        .options(Options::new().depth_tolerance(DEPTH_TOLERANCE))
        .ticks_a_second(TICK_RATE)
        .trust(trust.limits()?);
    let (receiver, guard) = surface::start_with_contacts(surface, limits)?;
    let wall = ForbiddenRegion::new(SPRING, MARGIN)?;
    let filter = Filter::new(STAND_OFF, ROBOT_SPEED)?.approach(APPROACH)?;
    let control = Control { guard, contacts, wall, filter, robot, bus, tick: Ticks(0) };
    Ok((Receiver::new(receiver, bus), control))
}

/// The state of the control tick.
pub struct Control<R> {
    guard: surface::Guard<RANGE>,
    contacts: &'static mut ContactList,
    wall: ForbiddenRegion,
    filter: Filter,
    robot: R,
    bus: &'static BusStatus,
    tick: Ticks,
}

impl<R: Robot> Control<R> {
    /// The tree that is searched.
    #[must_use]
    pub const fn tree(&self) -> &surface::Tree {
        self.guard.tracker().tree()
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

    /// The record of a simulated hand that pushed in the last tick.
    #[must_use]
    pub fn push(&self) -> Option<Push> {
        let tick = (self.tick.0 as u32).wrapping_sub(1);
        Some(Push { tick, ..self.robot.push()? })
    }

    /// Runs one tick. `clock` is any free-running counter; it only measures the time of the answer.
    pub fn tick(&mut self, clock: impl Fn() -> u32) -> Tick {
        let (tick, now) = (self.tick.0 as u32, time_of(self.tick));
        let tool = self.robot.instrument(tick);
        let command = self.robot.command();
        let start = clock();
        let Self { guard, contacts, filter, .. } = self;
        let mut listed = None;
        let (answer, admitted) = match (&tool, &command) {
            (Ok(tool), Some(command)) => {
                let (answer, admitted) = guard.admit(filter, tool, command, now);
                (answer, Some(admitted))
            }
            (Ok(tool), None) if RANGE > 0 => {
                let answer = guard.contacts(tool, MARGIN, now, contacts);
                listed = Some(contacts);
                (answer, None)
            }
            (Ok(tool), None) => (guard.closest(tool, now), None),
            // The pose is not finite, so no query is possible.
            (Err(_), _) => (guard.without_pose(now), None),
        };
        let took = clock().wrapping_sub(start);
        let force = match &admitted {
            Some(admitted) => {
                self.robot.execute(&answer, admitted);
                Vec3::ZERO
            }
            None => self.robot.apply(&answer, &answer.force(&self.wall)),
        };
        self.tick = self.tick.after(Ticks(1));
        Tick {
            tick,
            query_counts: took,
            force: force.to_array(),
            contacts: listed.as_ref().map_or(0, |contacts| contacts.len() as u32),
            contacts_bound: listed.map_or(f32::NEG_INFINITY, |contacts| contacts.bound()),
            ..record(&answer, tool.ok().as_ref(), self.bus)
        }
    }
}

fn record(answer: &Answer, tool: Option<&Capsule>, bus: &BusStatus) -> Tick {
    let mut record = Tick { kind: Tick::KIND, triangle: u32::MAX, ..Tick::zeroed() };
    (record.age, record.residual) = (u32::MAX, -1.0);
    record.bytes = bus.bytes();
    record.frames_published = bus.published();
    record.rejected = bus.rejected();
    (record.read_epoch, record.read_digest) = bus.fingerprint();
    if let Some(tool) = tool {
        record.tool_start = tool.start().to_array();
        record.tool_end = tool.end().to_array();
        record.tool_radius = tool.radius();
    }
    if let Some(searched) = &answer.searched {
        record.epoch = searched.frame.epoch;
        record.age = searched.frame.age.0;
        record.epoch_before = searched.before;
        record.blend = searched.t;
        record.residual = searched.residual.unwrap_or(-1.0);
        record.position_error = searched.position_error;
        record.surface_velocity = searched.velocity.to_array();
    }
    if let Ok(tracked) = &answer.tracked {
        record.front = tracked.opened;
        record.fallback = fallback_code(tracked.fallback);
        write(&tracked.closest, &mut record);
    }
    let trust = &answer.trust;
    record.state = trust.state as u32;
    record.cause = trust.cause.map_or(0, |cause| cause_code(&cause));
    record.margin = trust.margin;
    record.silence = answer.link.silence.0;
    record
}

fn write(closest: &Proximity, record: &mut Tick) {
    record.answered = 1;
    record.separation = closest.separation;
    record.lower = closest.lower;
    record.accuracy = closest.accuracy;
    record.point_on_surface = closest.point_on_surface.to_array();
    record.axis_parameter = closest.axis_parameter;
    record.direction = closest.direction.to_array();
    record.triangle = closest.triangle.map_or(u32::MAX, |triangle| triangle.0);
    record.node_tests = closest.node_tests;
    record.triangle_tests = closest.triangle_tests;
}

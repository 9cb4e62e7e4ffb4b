//! The guard: its velocities, its limits, and its behaviour before the first frame and after the last.

// Requirements: C-01, C-07

use dibs_build::{Builder, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, Guidance, SpringDamper};
use dibs_nostd::failsafe::{LimitError, Limits, State, ThresholdPair};
use dibs_nostd::filter::{Filter, FilterError, Reason, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Answer, Bus, Guard, GuardLimits, Surface};
use dibs_nostd::wire::{Encoding, Event, FrameEncoder, FrameId, Freshness, enframe};
use dibs_nostd::{
    Advance, Budget, Capsule, Cost, Error, Millis, Options, Proximity, Query, QueryError,
    SurfaceLimits, Tree, TreeBytes, Unavailable, VertexTable,
};
use dibs_tests::bus::collect;

const ROWS: usize = 162;

/// Ticks between two frames.
const PERIOD: u32 = 30;

/// The tissue's velocity, in mm/s.
const FLOW: Vec3 = Vec3::new(12.0, -5.0, 9.0);

type Ends<'t> = (Bus<'static, 't, u16>, Guard<'static, 't, u16, 64, 96>);

fn surface() -> &'static Surface<ROWS> {
    Box::leak(Box::new(Surface::new()))
}

/// A heart that drifts as a whole, its bus and its guard, from tick to tick.
struct World<'t> {
    ends: Ends<'t>,
    mesh_id: u32,
    rest: Vec<Vec3>,
    now: u32,
    is_serial: bool,
}

impl<'t> World<'t> {
    fn new(built: &'t dibs_build::BuiltTree, rest: &[Vec3], limits: GuardLimits) -> Self {
        let ends = surface().start(TreeBytes::new(built.blob()), limits).expect("valid");
        let (mesh_id, rest) = (built.summary().mesh_id, built.to_rows(rest));
        // A serial line's times echo a status from the clock's first turn on.
        Self { ends, mesh_id, rest, now: 1_000, is_serial: false }
    }

    fn shift(&self) -> Vec3 {
        FLOW * ((self.now - 1_000) as f32 * 1e-3)
    }

    /// Sends one frame, all packets at once.
    fn frame(&mut self) {
        let rows: Vec<Vec3> = self.rest.iter().map(|&row| row + self.shift()).collect();
        let epoch = self.now;
        let id = FrameId { mesh_id: self.mesh_id, session: 1, epoch };
        let fresh = Freshness { age_ms: 0, echo: Some(self.now) };
        let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("valid");
        for packet in collect(sender.with_freshness(fresh)) {
            if self.is_serial {
                let mut line = [0; 512];
                self.ends.0.receive(enframe(&packet, &mut line).expect("room"), Millis(self.now));
            } else {
                self.ends.0.packet(&packet, Millis(self.now)).expect("a good packet");
            }
        }
        while self.ends.0.work(100).expect("admitted") == Advance::Pending {}
    }

    /// A tick with a tool whose centre is at this offset from the rest shape's.
    fn tick(&mut self, at: Vec3) -> Answer {
        let tool = Capsule::new(at, at + Vec3::new(30.0, 4.0, 10.0), 2.0).expect("valid");
        self.now += 1;
        self.ends.1.closest(&tool, Millis(self.now))
    }
}

#[test]
fn the_velocity_is_that_of_the_tool_relative_to_the_tissue() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&heart).expect("a valid mesh");
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let mut world = World::new(&built, &heart.positions, limits);
    let start = Vec3::new(75.0, 0.0, 20.0);
    let spring = SpringDamper::stiffness(1.0).damping(0.001).max_force(5.0);
    let guide = Guidance::new(spring, 0.0).expect("valid");
    let (mut along, mut still, mut guided) = (0, 0, 0);
    for tick in 0..2_000 {
        if tick % PERIOD == 0 {
            world.is_serial = tick % 2 == 0;
            world.frame();
        }
        // First moving with the tissue, then at rest beside it.
        let is_along = tick < 1_200;
        let next = world.now + 1 - 1_000;
        let at = if is_along { start + FLOW * (next as f32 * 1e-3) } else { start + FLOW * 1.2 };
        let answer = world.tick(at);
        if tick < 4 * PERIOD || (1_195..1_205).contains(&tick) {
            continue;
        }
        let expected = if is_along { Vec3::ZERO } else { -FLOW };
        let searched = answer.searched.expect("a surface");
        assert!((answer.velocity - expected).length() < 0.3, "tick {tick}: {}", answer.velocity);
        assert!((searched.velocity - FLOW).length() < 0.3 && searched.lag == Some(Millis(0)));
        // The guide gets the pair and its velocity: it pulls the tool to the tissue, and damps.
        let force = answer.guide(&guide);
        assert_eq!(force, guide.force(&answer.closest, answer.velocity));
        if let Ok(pair) = answer.closest {
            assert!(force.force.dot(pair.direction) < 0.0, "{tick}: {force:?}");
            guided += 1;
        }
        *if is_along { &mut along } else { &mut still } += 1;
    }
    assert!(along > 1_000 && still > 700 && guided > 900, "{guided}");
}

/// Skipped ticks do not increase the tool's velocity.
#[test]
fn a_missed_tick_does_not_damp_more() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let limits = GuardLimits::new(0.0, Millis(1_000)).ticks_a_second(1_000);
    let mut world = World::new(&built, &heart.positions, limits);
    let at = Vec3::new(75.0, 0.0, 20.0);
    assert_eq!(world.tick(at).velocity, Vec3::ZERO, "the first");
    assert!((world.tick(at + Vec3::X * 0.1).velocity - Vec3::X * 100.0).length() < 0.1);
    world.now += 9; // ten ms in all
    let velocity = world.tick(at + Vec3::X * 1.1).velocity;
    assert!((100.0..=112.0).contains(&velocity.x), "{velocity}");
    // Without a pose nothing is known, and the velocity is measured anew at the next tick.
    world.frame();
    let blind = world.ends.1.without_pose(Millis(world.now));
    assert!(blind.velocity.is_nan() && blind.closest == Err(Unavailable::NoPose));
    assert_eq!((blind.trust.state, blind.trust.cause), (State::Safe, Some(Unavailable::NoPose)));
    assert_eq!(world.tick(at).velocity, Vec3::ZERO);
}

#[test]
fn the_state_is_safe_until_acknowledged_and_after_the_age() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let mut world = World::new(&built, &heart.positions, GuardLimits::new(20.0, Millis(100)));
    let spring = SpringDamper::stiffness(1.0).max_force(5.0);
    let wall = ForbiddenRegion::new(spring, 50.0).expect("valid");
    let at = Vec3::new(75.0, 0.0, 20.0);
    for tick in 0..1_500 {
        if tick % PERIOD == 0 {
            world.frame();
        }
        let answer = world.tick(at);
        assert_eq!(answer.trust.state, State::Safe, "nobody acknowledged");
        let waits = answer.trust.waits_for_acknowledgement;
        let cause = if waits { Unavailable::Unacknowledged } else { Unavailable::NoSurface };
        assert_eq!(waits, tick >= 1_000, "a second of good ticks");
        assert_eq!(answer.closest, Err(cause));
        assert_eq!(answer.force(&wall).state, ConstraintState::Safe(cause));
    }
    world.ends.1.acknowledge().expect("it waits");
    let mut found = Vec::new();
    for _ in 0..150 {
        let answer = world.tick(at);
        found.push((answer.trust.state, answer.searched.expect("a surface").frame.age.0));
    }
    for (state, age) in found {
        let expected = match age {
            ..=75 => State::Nominal,
            76..=100 => State::Degraded,
            _ => State::Safe,
        };
        assert_eq!(state, expected, "at {age} ms");
    }
    let mut status = [0; 96];
    let said = world.ends.0.status(Millis(world.now), &mut status).map(<[u8]>::len);
    assert!(said.is_some_and(|bytes| bytes > 32), "there is news: {said:?}");
    assert!(world.ends.0.status(Millis(world.now), &mut status).is_none(), "and then none");
}

/// The transit time of a frame without an echo is unbounded.
#[test]
fn a_line_without_statuses_is_a_written_choice() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let age = ThresholdPair::new(Millis(2_250), Millis(3_000)).expect("in order");
    let own = Limits::new(age, 0.02).expect("a speed");
    let cases = [(false, State::Safe), (true, State::Nominal)];
    for (has_own, (is_left_out, expected)) in
        [false, true].into_iter().flat_map(|own| cases.map(|case| (own, case)))
    {
        let limits = GuardLimits::new(20.0, Millis(3_000)).automatic();
        let limits = if has_own { limits.trust(own) } else { limits };
        let limits = if is_left_out { limits.without_transit() } else { limits };
        let mut world = World::new(&built, &heart.positions, limits);
        let rows = world.rest.clone();
        let id = FrameId { mesh_id: world.mesh_id, session: 1, epoch: 1 };
        let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("valid");
        for packet in collect(sender) {
            world.ends.0.packet(&packet, Millis(world.now)).expect("a good packet");
        }
        while world.ends.0.work(100).expect("admitted") == Advance::Pending {}
        let states = (0..1_100).map(|_| world.tick(Vec3::X * 80.0).trust.state);
        assert_eq!(states.last(), Some(expected));
    }
}

#[test]
fn a_start_names_what_is_wrong() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let bare = Builder::new().with_rest_shape(false).build(&heart).expect("a valid mesh");
    let limits = GuardLimits::new(20.0, Millis(100));
    let start = |blob, limits| surface().start::<u16, 64, 96>(TreeBytes::new(blob), limits).err();
    assert_eq!(start(built.blob(), limits), None);
    assert_eq!(start(bare.blob(), limits), Some(Error::Limit(LimitError::NoReach)));
    assert_eq!(start(bare.blob(), limits.surfaces(SurfaceLimits::reach_mm(200.0))), None);
    let backwards = start(built.blob(), GuardLimits::new(-1.0, Millis(100)));
    assert!(matches!(backwards, Some(Error::Limit(LimitError::Speed { .. }))), "{backwards:?}");
    assert!(matches!(start(&built.blob()[1..], limits), Some(Error::Format(_))));
    let shallow = surface().start::<u16, 1, 96>(TreeBytes::new(built.blob()), limits).err();
    assert!(matches!(shallow, Some(Error::Query(_))), "{shallow:?}");
    let standing = start(built.blob(), limits.ticks_a_second(0));
    assert_eq!(standing, Some(Error::Limit(LimitError::Rate)));
    let other: &Surface<161> = Box::leak(Box::new(Surface::new()));
    let other = other.start::<u16, 64, 96>(TreeBytes::new(built.blob()), limits).err();
    let expected = QueryError::VertexCount { expected: 162, found: 161 };
    assert_eq!(other, Some(Error::Query(expected)));
    let once = surface();
    let refused = once.start::<u16, 64, 96>(TreeBytes::new(built.blob()), limits.ticks_a_second(0));
    assert!(refused.is_err(), "and takes no end");
    let twice = || once.start::<u16, 64, 96>(TreeBytes::new(built.blob()), limits).err();
    assert_eq!(twice(), None);
    assert!(matches!(twice(), Some(Error::Split(_))));
}

/// A tick's work is limited in instructions, by the cost of a tick on its tree, or in tests; the last limit counts.
#[test]
fn a_tick_ends_within_its_instructions() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let cost = Cost::of_tick(&built.tree::<u16>().expect("16-bit indices"));
    let limits = GuardLimits::new(20.0, Millis(100)).automatic();
    let asked = |limits: GuardLimits| {
        let mut world = World::new(&built, &heart.positions, limits);
        world.frame();
        world.tick(Vec3::new(75.0, 0.0, 20.0)).tracked.expect("an answer").closest
    };
    let instructions = cost.base + 15 * cost.node_test;
    let budget = Budget::for_instructions(instructions, &cost);
    assert!((1..15).contains(&budget.tests()), "{budget:?}");
    let (whole, cut) = (asked(limits), asked(limits.instructions(instructions)));
    assert!(cut.node_tests < whole.node_tests && cut.lower < whole.lower, "{cut:?} {whole:?}");
    let same = |one: Proximity, other: Proximity| format!("{one:?}") == format!("{other:?}");
    assert!(same(cut, asked(limits.budget(budget))));
    assert!(same(whole, asked(limits.instructions(instructions).budget(Budget::UNLIMITED))));
    // Within a limit the answer's node tests include the other work that a budget counts. Nothing else differs.
    let mut ample = asked(limits.budget(budget).instructions(u32::MAX));
    ample.node_tests = whole.node_tests;
    assert!(same(ample, whole));
}

/// Bytes of a line that are no packet are counted, and the frames after them are published.
#[test]
fn bytes_that_are_no_packet_are_counted() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let mut world = World::new(&built, &heart.positions, GuardLimits::new(20.0, Millis(100)));
    world.is_serial = true;
    let (bus, now) = (&mut world.ends.0, Millis(world.now));
    // It ends before the nine bytes that it announces.
    bus.receive(&[10, 7, 7, 0], now);
    assert_eq!(bus.counters().of(Event::Framing), 1);
    // Longer than any packet: blocks of 254 bytes.
    let mut long = [&[255_u8][..], &[7; 254]].concat().repeat(5);
    long.push(0);
    bus.receive(&long, now);
    assert_eq!(bus.counters().of(Event::Framing), 2);
    world.frame();
    let bus = &world.ends.0;
    assert_eq!(bus.counters().of(Event::Framing), 2);
    assert_eq!(bus.surface().and_then(|frame| frame.epoch()), Some(world.now));
}

/// Only a command and a stand-off are given: speed, age and transit time of the tissue are the guard's.
#[test]
fn an_admitted_motion_keeps_off_the_tissue_as_it_is() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&heart).expect("a valid mesh");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a valid tree");
    let mut query = Query::<_, 64>::new(&tree).expect("a stack");
    let limits = GuardLimits::new(40.0, Millis(200)).automatic();
    let mut world = World::new(&built, &heart.positions, limits);
    let filter = Filter::new(1.0, 400.0).expect("in range");
    let middle = world.rest.iter().sum::<Vec3>() / ROWS as f32;
    let (mut at, mut end) = (Vec3::new(95.0, 3.0, 20.0), Vec3::new(125.0, 7.0, 30.0));
    let (mut reasons, mut refused, mut least) = ([0; 3], 0, f32::INFINITY);
    for tick in 0..3_000 {
        // At the end the frames stop.
        if tick % PERIOD == 0 && tick < 2_500 {
            world.frame();
        }
        world.now += 1;
        let towards = (middle + world.shift() - at).normalize_or_zero() * 0.1;
        let push = RigidMotion::new(at, towards, Vec3::new(0.0, 2e-4, 0.0));
        let tool = Capsule::new(at, end, 2.0).expect("valid");
        if tick == 2_000 {
            // An invalid command is an error without a motion.
            let none = RigidMotion::translation(Vec3::NAN);
            let (_, admitted) = world.ends.1.admit(&filter, &tool, &none, Millis(world.now));
            assert_eq!(admitted, Err(FilterError::Command));
        }
        let (answer, admitted) = world.ends.1.admit(&filter, &tool, &push, Millis(world.now));
        match admitted {
            Ok(admitted) => {
                let truth: Vec<Vec3> =
                    world.rest.iter().map(|&row| row + world.shift() + FLOW * 1e-3).collect();
                (at, end) = (admitted.motion.apply(at), admitted.motion.apply(end));
                let tool = Capsule::new(at, end, 2.0).expect("valid");
                let found = query.closest(truth.as_slice(), &tool, &Options::new()).expect("one");
                let is_said = admitted.reason == Reason::NoSafeMotion;
                assert!(
                    is_said || found.lower > 0.989,
                    "tick {tick}: {} {admitted:?}",
                    found.lower
                );
                assert!(found.lower >= admitted.least_separation - 2e-3, "{admitted:?}");
                least = least.min(found.lower);
                reasons[match admitted.reason {
                    Reason::Commanded => 0,
                    Reason::NoSafeMotion => 1,
                    _ => 2,
                }] += 1;
            }
            Err(FilterError::Untrusted(cause)) => {
                assert_eq!(answer.trust.cause, Some(cause));
                refused += 1;
            }
            Err(error) => panic!("{error}"),
        }
    }
    // Reasons that occurred: commanded, no safe motion, and shortened or nearest.
    assert!(reasons[0] > 100 && reasons[2] > 500 && least < 4.0, "{reasons:?} {least}");
    assert!(refused > 200, "{refused}");
    // Without a frame no surface is trusted.
    let mut world = World::new(&built, &heart.positions, limits);
    world.now += 1;
    let tool = Capsule::new(at, end, 2.0).expect("valid");
    let push = RigidMotion::translation(Vec3::X);
    let (_, admitted) = world.ends.1.admit(&filter, &tool, &push, Millis(1_001));
    assert_eq!(admitted, Err(FilterError::Untrusted(Unavailable::NoSurface)));
    // Nor at the very first tick, although a frame arrived before it.
    let mut world = World::new(&built, &heart.positions, limits);
    world.frame();
    world.now += 1;
    let (answer, admitted) = world.ends.1.admit(&filter, &tool, &push, Millis(world.now));
    assert_eq!(answer.trust.state, State::Safe);
    assert!(matches!(admitted, Err(FilterError::Untrusted(_))), "{admitted:?}");
}

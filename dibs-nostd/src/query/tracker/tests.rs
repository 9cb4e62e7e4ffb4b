//! Compares every bound in the front, after every tick, with the distances of all vertices below it.

// Requirement: T-01

extern crate std;

use std::env;
use std::vec::Vec;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use fastrand::Rng;
use glam::Vec3;

use super::Tracker;
use crate::format::MAX_STACK;
use crate::query::distances::{distance, least};
use crate::query::memory::clock::Deadline;
use crate::query::memory::front::{NOWHERE, UNUSED};
use crate::tree::format::NodeLink;
use crate::{
    Budget, Capsule, Contacts, Coverage, MotionReading, MovingSurface, Odometer, Options, Query,
    Side, Sphere, Tree, VertexTable, measure_stretch,
};

struct Bound {
    /// The slots of the opened node and of the child.
    slots: (u16, u32),
    /// The reading at which it runs out; distinguishes it from a later bound.
    deadline: Deadline,
    bound: f64,
    /// The distance of the nearest vertex below it.
    distance: f64,
}

/// Every bound in the front, none of which exceeds the distance of the nearest vertex below it.
fn bounds<const STACK: usize, const OPENED: usize>(
    tracker: &mut Tracker<'_, u16, STACK, OPENED>,
    far: &impl Fn(u32) -> f64,
) -> Vec<Bound> {
    let (tree, clock) = (tracker.tree, tracker.memory.clock);
    let mut front = tracker.memory.front.borrow();
    let mut bounds = Vec::new();
    for at in 0..front.used() as u16 {
        let node = *front.node(at).expect("a slot");
        if node.link == UNUSED {
            continue;
        }
        assert!((node.parent == NOWHERE) == (at == 0), "{node:?}");
        let (first, count, is_leaf) = match NodeLink::decode(node.link) {
            NodeLink::Children { first, count } => (first, count, false),
            NodeLink::Leaf { first, count } => (first, count, true),
        };
        for slot in (0..count).filter(|slot| node.apart & 1 << slot == 0) {
            let link = if is_leaf {
                NodeLink::Leaf { first: first + slot, count: 1 }
            } else {
                tree.node(first + slot).expect("a node").2
            };
            let deadline = node.deadlines[slot as usize];
            let bound = f64::from(clock.left(deadline));
            let distance = least(&tree, link, far);
            assert!(bound <= distance, "{node:?} {slot}: {bound} {distance}");
            bounds.push(Bound { slots: (at, slot), deadline, bound, distance });
        }
    }
    bounds
}

/// Frames of the random walk, 8 ticks each; `DIBS_BOUND_FRAMES` sets more.
fn frames() -> usize {
    env::var("DIBS_BOUND_FRAMES").map_or(60, |text| text.parse().expect("a number of frames"))
}

#[test]
fn no_bound_exceeds_the_distance() {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_280).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let mut tracker = Tracker::<_, 128, 128>::new(&tree).expect("enough");
    let mut odometer = Odometer::new(&tree);
    let mut rng = Rng::with_seed(16);
    let mut vector = |size: f32| Vec3::from([(); 3].map(|()| (rng.f32() - 0.5) * size));
    let positions: Vec<Vec<Vec3>> =
        motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let (mut tip, mut span) = (Vec3::new(70.0, 0.0, 20.0), Vec3::new(30.0, 20.0, 40.0));
    let (mut checked, mut above_zero) = (0, 0);
    for pair in positions.windows(2).cycle().take(frames()) {
        let [before, after] = pair else { unreachable!() };
        let step = odometer.step(before.as_slice(), after.as_slice());
        for tick in 0..8 {
            // Sometimes so far that the front restarts.
            let size = if tick == 7 { 10.0 } else { 0.5 };
            (tip, span) = (tip * 0.999 + vector(size), span * 0.999 + vector(size));
            let tool = Capsule::new(tip, tip + span, 2.0).expect("a valid capsule");
            let mut options = Options::cold().unsigned();
            if tick % 3 == 2 {
                options = options.budget(Budget::new(28));
            }
            let t = tick as f32 / 8.0;
            tracker.closest(&step.at(t), &tool, &options).expect("an answer");
            let at = |row: u32| {
                let (a, b) = (before[row as usize].as_dvec3(), after[row as usize].as_dvec3());
                (a + (b - a) * f64::from(t)).as_vec3()
            };
            let bounds = bounds(&mut tracker, &|row| distance(&tool, at(row)));
            checked += bounds.len();
            above_zero += bounds.iter().filter(|bound| bound.bound > 0.0).count();
        }
    }
    std::println!("{checked} bounds, {above_zero} of them above zero");
    assert!(above_zero > 150 * frames());
}

/// Positions that are each off by up to this (mm).
struct Rough<'a>(&'a [Vec3], f32);

impl VertexTable for Rough<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.0.position(vertex)
    }

    fn position_error(&self) -> f32 {
        self.1
    }
}

/// The error of the positions counts twice: when the pair was searched, and now. With an error that is no number, no
/// pair rests.
#[test]
fn a_pair_rests_only_if_it_is_farther_than_the_errors_of_both_searches() {
    let built = Builder::new().stretch(1.5).build(&band(160)).expect("builds");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let rest: Vec<Vec3> =
        (0..tree.vertex_count()).map(|row| tree.rest_position(row).expect("a row")).collect();
    for (height, error, searched) in
        [(1.5, 1.0, 2), (1.9, 1.0, 2), (2.1, 1.0, 1), (9.0, 1.0, 1), (9.0, f32::NAN, 2)]
    {
        let rough = Rough(rest.as_slice(), error);
        let surface = Odometer::new(&tree).start(&rough);
        let tool = |x: f32, height: f32| {
            Sphere::new(Vec3::new(x, 0.05, 5.0 + height), 0.5).expect("valid")
        };
        let tools = [tool(40.0, 0.0), tool(120.0, height)];
        let [mut near, mut far] =
            [(); 2].map(|()| Tracker::<_, 128, 128>::new(&tree).expect("enough"));
        let mut ask = || {
            let mut pairs = [(&mut near, &surface, &tools[0]), (&mut far, &surface, &tools[1])];
            let options = Options::cold().unsigned();
            Tracker::closest_of(&mut pairs, &options).expect("an answer").expect("two pairs")
        };
        assert_eq!(ask().searched, 2);
        assert_eq!(ask().searched, searched, "{height} {error}");
    }
}

/// Rows as received, beyond the stretch limit: the answer states that it relies on the tree's limit.
#[test]
fn an_answer_says_whether_the_stretch_was_checked() {
    let built = Builder::new().stretch(1.5).build(&band(160)).expect("builds");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let rest: Vec<Vec3> =
        (0..tree.vertex_count()).map(|row| tree.rest_position(row).expect("a row")).collect();
    let large: Vec<Vec3> = rest.iter().map(|&row| row * 1.6).collect();
    let tool = Sphere::new(Vec3::new(40.0, 0.05, 5.0), 0.5).expect("valid");
    let mut tracker = Tracker::<_, 128, 128>::new(&tree).expect("enough");
    let mut odometer = Odometer::new(&tree);
    let measured = measure_stretch(&tree, rest.as_slice()).expect("at rest");
    assert!(measure_stretch(&tree, large.as_slice()).is_err());
    let both = measured.or_larger(measured).expect("one tree");
    for (rows, options, coverage) in [
        (&large, Options::cold(), Coverage::Assumed),
        (&rest, Options::cold(), Coverage::Assumed),
        (&rest, Options::cold().stretch(measured), Coverage::Measured),
        (&rest, Options::cold().stretch(both), Coverage::Proven),
    ] {
        let surface = odometer.start(rows.as_slice());
        let tracked = tracker.closest(&surface, &tool, &options).expect("an answer");
        assert_eq!((tracked.closest.coverage, tracked.moved), (coverage, None));
        let again = tracker.closest(&surface, &tool, &options).expect("an answer");
        assert_eq!(again.moved, Some(0.0));
        let tools = [tool; 2];
        let mut query = Query::<_, 128>::new(&tree).expect("enough");
        let of = query.closest_of(rows.as_slice(), &tools, &options).expect("an answer");
        assert_eq!(of.map(|found| found.proximity.coverage), Some(coverage));
    }
}

/// A straight band of squares, a tenth as wide as they are long.
fn band(squares: u32) -> Mesh {
    let corner = |number: u32| Vec3::new((number / 2) as f32, (number % 2) as f32 * 0.1, 0.0);
    let square = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]];
    Mesh {
        positions: (0..2 * squares + 2).map(corner).collect(),
        triangles: (0..squares).flat_map(square).collect(),
        ..Mesh::default()
    }
}

/// Puts a sphere above one end of a band and moves one of them along the band, so that the sphere and the other end
/// approach. Returns the remaining slack of a bound found at the start, as a fraction of the distance moved.
fn approach(built: &BuiltTree, moves_tool: bool) -> f64 {
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let mut tracker = Tracker::<_, 128, 128>::new(&tree).expect("enough");
    let mut odometer = Odometer::new(&tree);
    let rest: Vec<Vec3> =
        (0..tree.vertex_count()).map(|row| tree.rest_position(row).expect("a row")).collect();
    let mut before = rest.clone();
    let (mut first, mut spare) = (Vec::new(), f64::INFINITY);
    for tick in 0..300_u16 {
        let displacement = f32::from(tick) * 0.37;
        let (along, back) = if moves_tool { (displacement, 0.0) } else { (0.0, displacement) };
        let after: Vec<Vec3> = rest.iter().map(|&p| p - Vec3::X * back).collect();
        let surface = odometer.step(before.as_slice(), after.as_slice()).after();
        let tool = Sphere::new(Vec3::new(along, 0.0, 0.2), 0.1).expect("a valid sphere");
        let measured = measure_stretch(&tree, after.as_slice()).expect("within the limit");
        let options = Options::cold().unsigned().stretch(measured);
        let found = tracker.closest(&surface, &tool, &options).expect("an answer");
        assert_eq!(found.fallback.is_some(), tick == 0, "{tick}: {found:?}");
        let bounds = bounds(&mut tracker, &|row| distance(&tool, after[row as usize]));
        if tick == 0 {
            first = bounds.iter().map(|bound| (bound.slots, bound.deadline)).collect();
        } else {
            let old = bounds.iter().filter(|bound| first.contains(&(bound.slots, bound.deadline)));
            let least = old.map(|bound| bound.distance - bound.bound).fold(f64::INFINITY, f64::min);
            spare = spare.min(least / f64::from(displacement));
        }
        before = after;
    }
    spare
}

/// In straight motion bounds are used up except for rounding, so a motion underestimated by a thousandth would show.
#[test]
fn bounds_are_used_up_as_fast_as_tool_and_surface_move() {
    let built = Builder::new().stretch(1.5).build(&band(160)).expect("builds");
    for moves_tool in [true, false] {
        let spare = approach(&built, moves_tool);
        std::println!("{spare:.1e} of the displacement to spare");
        assert!(spare < 3e-4, "{spare}");
    }
}

/// A surface with this position error.
struct Off<'a> {
    rows: &'a [Vec3],
    motion: Option<MotionReading>,
    error: f32,
}

impl VertexTable for Off<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.rows.position(vertex)
    }

    fn position_error(&self) -> f32 {
        self.error
    }
}

impl crate::surface::motion::sealed::Sealed for Off<'_> {}

impl MovingSurface for Off<'_> {
    fn motion(&self) -> Option<MotionReading> {
        self.motion
    }
}

/// The bounds kept from the last tick are certain for the table's positions. Their position error is this tick's.
#[test]
fn an_error_that_grows_widens_what_is_kept() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    let motion = Odometer::new(&tree).start(rows.as_slice()).motion();
    let tool = Sphere::new(Vec3::new(80.0, 0.0, 20.0), 2.5).unwrap();
    let mut tracker = Tracker::<_, 64, 64>::new(&tree).unwrap();
    let mut tick = |error: f32, budget: Budget| {
        let surface = Off { rows: &rows, motion, error };
        let options = Options::cold().budget(budget);
        tracker.closest(&surface, &tool, &options).unwrap().closest
    };
    let known = tick(0.5, Budget::UNLIMITED);
    let none = Budget::new(0);
    for error in [2.0, 0.25, 0.0] {
        let kept = tick(error, none);
        assert_eq!(kept.side, known.side);
        let (first, now) = (known.interval(), kept.interval());
        let expected = [first.lower + 0.5 - error, first.upper - 0.5 + error];
        for (end, expected) in [now.lower, now.upper].into_iter().zip(expected) {
            assert!((end - expected).abs() < 0.05, "{error}: {now:?} {expected}");
        }
        assert!(now.lower <= expected[0] + 1e-3 && now.upper >= expected[1] - 1e-3, "{now:?}");
    }
}

/// Where the last tick and this one exclude each other, the motion was larger than stated: only this one counts.
#[test]
fn a_motion_larger_than_stated_makes_nothing_certain() {
    let mesh = generate::brain(500).unwrap();
    let built = Builder::new().build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    let motion = Odometer::new(&tree).start(rows.as_slice()).motion();
    let mut query = Query::<_, MAX_STACK>::new(&tree).unwrap();
    let sphere = |at: Vec3| Sphere::new(at, 1.0).unwrap();
    let (outside, inside) =
        (Vec3::new(150.0, 0.0, 20.0), rows.iter().sum::<Vec3>() / rows.len() as f32);
    let pair = query.closest(rows.as_slice(), &sphere(outside), &Options::cold()).unwrap();
    // The root's pin comes next to the tool, and the budget covers no other test.
    let pin = rows[tree.node(0).expect("a root").0 as usize];
    let (all, none) = (Budget::UNLIMITED, Budget::new(0));
    let half = pair.direction * pair.axis_distance * 0.5;
    for (at, side, by, budget) in [
        (outside, Side::Outside, half, all),
        (outside, Side::Outside, outside - pair.point_on_surface, all),
        (outside, Side::Outside, outside - pin - Vec3::X, none),
        (inside, Side::Inside, inside - pin - Vec3::X, none),
    ] {
        // Its front is always full, so that each tick is a whole query.
        let mut tracker = Tracker::<_, MAX_STACK, 1>::new(&tree).unwrap();
        let mut tick = |rows: &[Vec3], options: &Options| {
            let surface = Off { rows, motion, error: 0.0 };
            tracker.closest(&surface, &sphere(at), options).unwrap()
        };
        assert_eq!(tick(&rows, &Options::cold()).closest.side, side);
        let moved: Vec<Vec3> = rows.iter().map(|&row| row + by).collect();
        let options = Options::cold().budget(budget);
        let found = tick(&moved, &options);
        let alone = query.closest(moved.as_slice(), &sphere(at), &options).unwrap();
        assert_eq!((found.closest.side, found.is_kept), (alone.side, false), "{by}");
        let off = (found.closest.separation - alone.separation).abs();
        assert!(off <= 2.0 * found.closest.accuracy, "{by}: {found:?} {alone:?}");
    }
}

/// Where the surface's motion is not known, each list is a whole query's, within the tick's budget.
#[test]
fn contacts_of_a_surface_whose_motion_is_not_known_are_those_of_a_query() {
    const MARGIN: f32 = 8.0;
    let mesh = generate::heart(1_280).unwrap().mesh;
    let built = Builder::new().build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let rows = built.to_rows(&mesh.positions);
    let surface = Off { rows: &rows, motion: None, error: 0.0 };
    let mut tracker = Tracker::<_, MAX_STACK, 64, 64>::with_range(&tree).unwrap();
    let mut query = Query::<_, MAX_STACK>::new(&tree).unwrap();
    let (mut own, mut whole) = (Contacts::<32>::new(), Contacts::<32>::new());
    let (mut short, mut complete) = (0, 0);
    for row in (0..rows.len()).step_by(61) {
        let tool = Sphere::new(rows[row] * 1.05, 1.0).unwrap();
        query.contacts(&surface, &tool, MARGIN, &Options::cold(), &mut whole).unwrap();
        for tests in (0..900).step_by(7).chain([1_000_000]) {
            let options = Options::new().budget(Budget::new(tests));
            let found = tracker.contacts(&surface, &tool, MARGIN, &options, &mut own).unwrap();
            assert!(found.closest.work() <= tests + 1 + Budget::TRIANGLE, "{tests} {found:?}");
            let bound = own.bound() - 2.0 * own.accuracy();
            for one in whole.iter().filter(|one| one.separation < bound) {
                let is_listed =
                    own.iter().any(|other| (other.separation - one.separation).abs() < 1e-3);
                assert!(is_listed, "{row} {tests}: {one:?} {own:?}");
            }
            let is_complete = own.within(MARGIN).is_ok_and(|list| list.is_complete());
            *if is_complete { &mut complete } else { &mut short } += 1;
            assert!(is_complete || tests < 1_000_000, "{row}: {own:?}");
        }
        assert_eq!(own.len(), whole.len(), "{row}: {own:?} {whole:?}");
    }
    std::println!("{complete} lists complete, {short} cut short");
    assert!(complete > 10 && short > 100, "{complete} {short}");
}

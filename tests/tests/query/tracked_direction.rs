//! Poses with jitter where triangles tie: a tracker's direction does not alternate with their last digits.

// Requirement: T-03

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Contacts, MovingTable, Odometer, Options, Proximity, Query, Side, Tool, Tracker,
    Unavailable, glam::Vec3,
};
use dibs_tests::deform::unit;
use dibs_tests::surfaces::Inexact;
use fastrand::Rng;

/// Ticks at a tie.
const TICKS: u32 = 60;

/// Amplitude (mm) of the jitter of each coordinate of a pose.
const JITTER: f32 = 3e-4;

/// Distance (mm) from a tie at which the closest triangle is certain whatever the accuracy.
const CLEAR: f32 = 0.1;

/// Results at the ties of one kind of pose.
#[derive(Debug, Default)]
struct Turns {
    ties: u32,
    /// Changes of the direction by 45 degrees and more between two ticks: with complete queries, and with a tracker.
    whole: u32,
    tracked: u32,
    /// Ticks in which the tracker's direction differs from the query's.
    kept: u32,
    /// Ticks beyond a tie.
    beyond: u32,
}

/// The cosine of 45 degrees: a smaller product of two directions is a turn.
const TURN: f32 = 0.707;

/// The distance (mm) between the points of a pair, from the tool's axis.
fn length(tool: &Capsule, found: &Proximity) -> f32 {
    tool.axis_point(found.axis_parameter).distance(found.point_on_surface)
}

/// A scene at rest, and a complete query on it.
struct Scene<'t, 's> {
    query: Query<'t, u16, MAX_STACK>,
    surface: MovingTable<'s, [Vec3]>,
}

impl Scene<'_, '_> {
    fn ask(&mut self, tool: &Capsule) -> Proximity {
        self.query.closest(&self.surface, tool, &Options::cold()).expect("an answer")
    }

    /// Two neighbouring poses between two poses with the same side and different directions.
    fn tie(&mut self, from: Capsule, to: Capsule) -> Option<[Capsule; 2]> {
        let (mut from, mut to) = (from, to);
        let side = self.ask(&from).side;
        let first = self.ask(&from).direction;
        for _ in 0..40 {
            let middle = moved(&from, 0.5 * (to.start() - from.start()));
            if middle.start() == from.start() || middle.start() == to.start() {
                break;
            }
            let found = self.ask(&middle);
            if found.side != side {
                return None;
            }
            if found.direction.dot(first) < TURN { to = middle } else { from = middle }
        }
        let (one, other) = (self.ask(&from), self.ask(&to));
        // Where the direction changes slowly nothing ties, and next to the surface it is the surface's own normal.
        let is_tie = one.direction.dot(other.direction) < TURN && length(&from, &one) > 0.5;
        is_tie.then_some([from, to])
    }
}

fn moved(tool: &Capsule, by: Vec3) -> Capsule {
    Capsule::new(tool.start() + by, tool.end() + by, tool.radius()).expect("finite")
}

/// Ticks at ties of a mesh, by the tool's length: outside, and inside or crossing.
fn turns_at_ties(mesh: &Mesh, size: f32, axis: f32, most: u32) -> [Turns; 2] {
    let built = Builder::new().build(mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let query = Query::new(&tree).expect("deep enough");
    let mut scene = Scene { query, surface };
    let mut rng = Rng::with_seed(37);
    let mut found = [Turns::default(), Turns::default()];
    for _ in 0..40 * most {
        let start = unit(&mut rng) * size * rng.f32();
        let along = unit(&mut rng) * axis;
        let from = Capsule::new(start, start + along, 1.0).expect("finite");
        let to = moved(&from, unit(&mut rng) * 3.0);
        let (one, other) = (scene.ask(&from), scene.ask(&to));
        if one.side != other.side || one.direction.dot(other.direction) >= TURN {
            continue;
        }
        let turns = &mut found[usize::from(one.side != Side::Outside)];
        if turns.ties == most {
            continue;
        }
        let Some([near, beyond]) = scene.tie(from, to) else { continue };
        turns.ties += 1;
        let mut tracker = Tracker::<u16, MAX_STACK, 512>::new(&tree).expect("deep enough");
        let (mut last, mut last_whole) = (None, None);
        for _ in 0..TICKS {
            let noise = [(); 3].map(|()| (2.0 * rng.f32() - 1.0) * JITTER);
            let tool = moved(&near, noise.into());
            let whole = scene.ask(&tool);
            let tracked = tracker.closest(&scene.surface, &tool, &Options::new());
            let tracked = tracked.expect("an answer").closest;
            assert_eq!(tracked.side, whole.side);
            let tie = 2.0 * tracked.accuracy + 2.0 * whole.accuracy;
            let width = whole.separation - whole.lower + tracked.separation - tracked.lower;
            let excess = length(&tool, &tracked) - length(&tool, &whole);
            assert!(excess <= tie + width, "{excess} {tie} {width}");
            let has_turned = |last: Option<Vec3>, now: Vec3| {
                u32::from(last.is_some_and(|last| last.dot(now) < TURN))
            };
            turns.whole += has_turned(last_whole, whole.direction);
            turns.tracked += has_turned(last, tracked.direction);
            turns.kept += u32::from(tracked.direction.dot(whole.direction) < TURN);
            (last, last_whole) = (Some(tracked.direction), Some(whole.direction));
        }
        // Beyond the tie, on either side, the direction is that of a complete query, whatever error the surface states.
        let apart = (to.start() - from.start()).normalize() * CLEAR;
        for error in [0.0, 1.0] {
            let table = Inexact(&rows, error);
            let surface = Odometer::new(&tree).start(&table);
            let mut tracker = Tracker::<u16, MAX_STACK, 512>::new(&tree).expect("deep enough");
            for tool in [moved(&near, -apart), moved(&beyond, apart)] {
                let whole = scene.ask(&tool);
                let tracked = tracker.closest(&surface, &tool, &Options::new());
                let tracked = tracked.expect("an answer").closest;
                if axis == 0.0 && scene.ask(&moved(&tool, apart * 0.5)).triangle == whole.triangle {
                    turns.beyond += 1;
                    assert!(tracked.direction.dot(whole.direction) > TURN, "{tracked:?} {whole:?}");
                }
            }
        }
    }
    found
}

#[test]
fn no_direction_turns_to_and_fro_at_a_tie() {
    let most = if cfg!(debug_assertions) { 5 } else { 60 };
    let heart = generate::heart(2_000).expect("a valid size").mesh;
    let brain = generate::brain(8_000).expect("a valid size");
    let (mut whole, mut tracked, mut kept, mut beyond) = (0, 0, 0, 0);
    for (mesh, size) in [(&heart, 60.0), (&brain, 70.0)] {
        for axis in [0.0, 40.0] {
            let found = turns_at_ties(mesh, size, axis, most);
            for (turns, place) in found.iter().zip(["outside", "inside or crossing"]) {
                println!("{place}, axis of {axis} mm: {turns:?}");
                whole += turns.whole;
                tracked += turns.tracked;
                kept += turns.kept;
                beyond += turns.beyond;
            }
        }
    }
    assert!(whole > 20 * most && tracked * 100 < whole, "{whole} {tracked}");
    assert!(kept > most && beyond > most, "{kept} {beyond}");
}

/// Two pyramids on one base, at rest and collapsed onto it.
fn pyramids() -> (BuiltTree, [Vec<Vec3>; 2]) {
    let rim = [[-8.0, -8.0], [8.0, -8.0], [8.0, 8.0], [-8.0, 8.0]];
    let mut positions = rim.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
    positions.extend([Vec3::Z, Vec3::NEG_Z]);
    let edges = [[0, 1], [1, 2], [2, 3], [3, 0]].into_iter();
    let triangles = edges.flat_map(|[a, b]| [[a, b, 4], [b, a, 5]]).collect();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let thick = built.to_rows(&mesh.positions);
    let flat = thick.iter().map(|at| at.with_z(0.0)).collect();
    (built, [thick, flat])
}

/// An axis of 10 mm along z.
fn upright(x: f32, lowest: f32) -> Capsule {
    let [start, end] = [lowest, lowest + 10.0].map(|z| Vec3::new(x, 1.0, z));
    Capsule::new(start, end, 0.5).expect("finite")
}

/// Where the axis meets an edge whose two triangles face away from each other, there is no normal.
#[test]
fn an_axis_at_an_edge_without_a_normal_keeps_the_last_direction() {
    let (built, [thick, flat]) = pyramids();
    let tree = built.tree::<u16>().expect("16-bit indices");
    let tool = |x: f32| upright(x, -5.0);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let whole = query.closest(flat.as_slice(), &tool(8.0), &Options::cold()).expect("an answer");
    assert_eq!((whole.side, whole.direction), (Side::Crossing, Vec3::ZERO));
    let mut tracker = Tracker::<u16, MAX_STACK, 64>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(thick.as_slice());
    let beside = tracker.closest(&surface, &tool(9.0), &Options::new()).expect("an answer");
    assert_eq!(beside.closest.side, Side::Outside);
    let surface = odometer.step(thick.as_slice(), flat.as_slice()).after();
    let met = tracker.closest(&surface, &tool(8.0), &Options::new()).expect("an answer").closest;
    assert_eq!(met.side, Side::Crossing);
    assert!(met.direction.dot(Vec3::X) > 0.999, "{met:?}");
    assert!(met.point_on_tool.distance(Vec3::new(7.5, 1.0, 0.0)) < 1e-3, "{met:?}");
}

/// A tool that began at such an edge never had a direction. Above the collapsed walls it may be inside, and no contact
/// says how deep.
#[test]
fn contacts_have_no_side_where_no_tick_had_a_direction() {
    let (built, [_, flat]) = pyramids();
    let tree = built.tree::<u16>().expect("16-bit indices");
    let surface = Odometer::new(&tree).start(flat.as_slice());
    let mut tracker = Tracker::<u16, MAX_STACK, 64>::new(&tree).expect("deep enough");
    let met = tracker.closest(&surface, &upright(8.0, -5.0), &Options::new()).expect("an answer");
    assert_eq!((met.closest.side, met.closest.direction), (Side::Crossing, Vec3::ZERO));
    let mut contacts = Contacts::<4>::new();
    let above = upright(5.0, 1.0);
    let found = tracker.contacts(&surface, &above, 5.0, &Options::new(), &mut contacts);
    let found = found.expect("an answer");
    assert!(found.is_kept, "{found:?}");
    assert_eq!((found.closest.side, found.closest.direction), (Side::Either, Vec3::ZERO));
    let wall = contacts.within(5.0).expect("a wall to act on").next().expect("the upper wall");
    assert!((wall.separation - 0.5).abs() < 1e-3 && wall.normal.z > 0.999, "{wall:?}");
    assert_eq!(contacts.within(0.25).err(), Some(Unavailable::NoSide));
}

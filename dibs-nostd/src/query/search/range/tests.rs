//! Compares every bound in the front of a range search with the distances of all vertices below it.

// Requirement: T-01

extern crate std;

use std::vec::Vec;

use dibs_build::{Builder, generate};
use fastrand::Rng;
use glam::Vec3;

use super::Search;
use crate::query::distances::{distance, least};
use crate::query::memory::Memory;
use crate::query::memory::clock::MotionClock;
use crate::query::search::WaitingNode;
use crate::surface::motion::Unit;
use crate::tree::RootSet;
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Budget, Capsule, MovingSurface, Odometer, Options, Tree};

const LIMIT: f32 = 6.0;
const PROMINENCE: f32 = 0.1;

/// The bounds in the front, in mm: none exceeds the distance of the nearest vertex below it, and after a whole search
/// none is less than the limit, except for rounding. Every triangle is below exactly one of them, or in a leaf within
/// the range.
fn bounds<const M: usize>(
    memory: &mut Memory<1, 1, M>,
    tree: &Tree<'_, u16>,
    far: &impl Fn(u32) -> f64,
) -> Vec<f64> {
    let clock = memory.clock;
    let (mut bounds, mut seen) = (Vec::new(), std::vec![0; tree.triangle_count() as usize]);
    for node in memory.range.clone().now(clock, None).rest(0) {
        let NodeLink::Children { first, count } = NodeLink::decode(node.link) else {
            unreachable!()
        };
        let bound = f64::from(clock.left(node.deadline));
        for slot in (0..count).filter(|slot| node.opened >> slot & 1 == 0) {
            let link = tree.node(first + slot).expect("a node").2;
            count_triangles(tree, link, &mut seen);
            if node.near >> slot & 1 == 0 {
                let distance = least(tree, link, far);
                assert!(bound <= distance, "{node:?} {slot}: {bound} {distance}");
                assert!(bound > f64::from(LIMIT) - 1e-4, "{node:?} {slot}: {bound} was not tested");
                bounds.push(distance - bound);
            }
        }
    }
    assert!(seen.iter().all(|&times| times == 1));
    bounds
}

fn count_triangles(tree: &Tree<'_, u16>, link: NodeLink, seen: &mut [u32]) {
    match link {
        NodeLink::Children { first, count } => (first..first + count)
            .for_each(|row| count_triangles(tree, tree.node(row).expect("a node").2, seen)),
        NodeLink::Leaf { first, count } => {
            (first..first + count).for_each(|row| seen[row as usize] += 1);
        }
    }
}

#[test]
fn no_bound_of_a_range_exceeds_the_distance() {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_280).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let positions: Vec<Vec<Vec3>> =
        motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let mut odometer = Odometer::new(&tree);
    let mut rng = Rng::with_seed(16);
    let mut vector = |size: f32| Vec3::from([(); 3].map(|()| (rng.f32() - 0.5) * size));
    let mut stack = [WaitingNode { lower: 0.0, link: 0 }; 128];
    let mut memory = Memory::<1, 1, 256>::new(Unit::of(&tree));
    // Deadlines wrap early.
    memory.clock = MotionClock::wrapping_after(Unit::of(&tree), 1 << 22);
    let (mut tip, mut span) = (Vec3::new(50.0, 0.0, 20.0), Vec3::new(30.0, 20.0, 40.0));
    let (mut checked, mut kept) = (0, 0);
    for (number, pair) in positions.windows(2).cycle().take(60).enumerate() {
        let [before, after] = pair else { unreachable!() };
        let step = odometer.step(before.as_slice(), after.as_slice());
        for tick in 0..8 {
            // Every other frame the tool rests; sometimes it jumps.
            if number % 2 == 0 {
                let size = if tick == 7 { 10.0 } else { 0.5 };
                (tip, span) = (tip * 0.999 + vector(size), span * 0.999 + vector(size));
            }
            let tool = Capsule::new(tip, tip + span, 2.0).expect("a valid capsule");
            let t = tick as f32 / 8.0;
            let surface = step.at(t);
            let motion = surface.motion().expect("measured");
            let moved = memory.moved(&tool, Some(motion));
            memory.begin(moved);
            memory.keep(&tool, Some(motion), true);
            let mut search = |options: &Options| {
                let search = Search::start(
                    RootSet::ALL,
                    &tree,
                    &mut stack,
                    &surface,
                    &tool,
                    options,
                    None,
                    None,
                );
                let mut moved = memory.range.now(memory.clock, None);
                kept += usize::from(!moved.is_empty());
                let visit = |_, _: &_| LIMIT;
                let search = search.expect("valid");
                let (beyond, _) =
                    search.each_low_from(&mut moved, LIMIT, (PROMINENCE, options), visit)?;
                let is_whole = beyond == f32::INFINITY;
                moved.keep(is_whole);
                Ok::<_, QueryError>(is_whole)
            };
            // Budgets of any size, until one is enough.
            let budgets = if tick == 4 { 0..2_000 } else { 2_000..2_001 };
            let is_whole = budgets.into_iter().any(|node_tests| {
                search(&Options::cold().budget(Budget::new(node_tests))).expect("an answer")
            });
            assert!(is_whole);
            let at = |row: u32| {
                let (a, b) = (before[row as usize].as_dvec3(), after[row as usize].as_dvec3());
                (a + (b - a) * f64::from(t)).as_vec3()
            };
            checked += bounds(&mut memory, &tree, &|row| distance(&tool, at(row))).len();
        }
    }
    std::println!("{checked} bounds, {kept} fronts kept, {:?}", memory.clock);
    assert!(checked > 20_000 && kept > 300 && memory.clock.has_wrapped());
}

/// Nodes that a budget never reaches stay due, however far tool and surface move in between: deadlines wrap.
#[test]
fn a_node_that_no_search_reaches_stays_due() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("builds");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut by_x = rows.clone();
    by_x.sort_by(|a, b| a.x.total_cmp(&b.x));
    let at = |tip: Vec3, out: Vec3| Capsule::new(tip + out, tip + out * 9.0, 0.5);
    let first = at(by_x[by_x.len() - 1], Vec3::X).expect("a valid capsule");
    let last = at(by_x[0], -Vec3::X).expect("a valid capsule");
    let mut stack = [WaitingNode { lower: 0.0, link: 0 }; 128];
    let mut memory = Memory::<1, 1, 256>::new(Unit::of(&tree));
    let mut visited = 0;
    for tick in 0..=6_000 {
        memory.begin(Ok(1 << 19));
        let tool = if tick < 6_000 { first } else { last };
        let is_whole = tick == 0 || tick == 6_000;
        let budget = if is_whole { Budget::UNLIMITED } else { Budget::new(0) };
        let options = Options::cold().budget(budget);
        let search = Search::start(
            RootSet::ALL,
            &tree,
            &mut stack,
            rows.as_slice(),
            &tool,
            &options,
            None,
            None,
        );
        let mut front = memory.range.now(memory.clock, None);
        visited = 0;
        let visit = |_, _: &_| {
            visited += 1;
            LIMIT
        };
        let search = search.expect("valid");
        let found = search.each_low_from(&mut front, LIMIT, (PROMINENCE, &options), visit);
        front.keep(found.expect("an answer").0 == f32::INFINITY);
    }
    assert!(visited > 0, "{:?}", memory.clock);
}

//! Every bound in the front, after every tick, against the distances of all vertices below it.

extern crate std;

use std::vec::Vec;

use dibs_build::{Builder, generate};
use fastrand::Rng;
use glam::{DVec3, Vec3};

use super::Tracker;
use super::front::{NOWHERE, UNUSED};
use crate::tree::format::Link;
use crate::{Budget, Capsule, Odometer, Options, Tool, Tree};

/// Distance from a capsule's axis, in f64.
fn distance(tool: &Capsule, point: Vec3) -> f64 {
    let start = tool.axis_start().as_dvec3();
    let span: DVec3 = tool.end().as_dvec3() - start;
    let along = (point.as_dvec3() - start).dot(span) / span.length_squared();
    (point.as_dvec3() - start - span * along.clamp(0.0, 1.0)).length()
}

/// The least distance of any vertex below a link.
fn least(tree: &Tree<'_, u16>, link: Link, far: &impl Fn(u32) -> f64) -> f64 {
    match link {
        Link::Children { first, count } => (first..first + count)
            .map(|row| least(tree, tree.node(row).expect("a node").2, far))
            .fold(f64::INFINITY, f64::min),
        Link::Leaf { first, count } => (first..first + count)
            .flat_map(|row| tree.triangle(row).expect("a triangle"))
            .map(far)
            .fold(f64::INFINITY, f64::min),
    }
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
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let (mut tip, mut span) = (Vec3::new(70.0, 0.0, 20.0), Vec3::new(30.0, 20.0, 40.0));
    let (mut checked, mut positive) = (0, 0);
    for (number, pair) in frames.windows(2).cycle().take(60).enumerate() {
        let [before, after] = pair else { unreachable!() };
        let step = odometer.step(before.as_slice(), after.as_slice());
        for tick in 0..8 {
            // Now and then so far that the front starts anew.
            let size = if tick == 7 { 10.0 } else { 0.5 };
            (tip, span) = (tip * 0.999 + vector(size), span * 0.999 + vector(size));
            let tool = Capsule::new(tip, tip + span, 2.0).expect("a valid capsule");
            let mut options = Options::cold().unsigned();
            if tick % 3 == 2 {
                options = options.budget(Budget { node_tests: 12, triangle_tests: 2 });
            }
            let share = tick as f32 / 8.0;
            let surface = step.at(share);
            tracker.closest(&surface, &tool, &options).expect("an answer");
            let at = |row: u32| {
                let (a, b) = (before[row as usize].as_dvec3(), after[row as usize].as_dvec3());
                (a + (b - a) * f64::from(share)).as_vec3()
            };
            let far = |row: u32| distance(&tool, at(row));
            let (unit, now) = (tracker.unit, tracker.now);
            let mut front = tracker.front.borrow();
            for place in 0..front.used() as u16 {
                let node = *front.node(place).expect("a place");
                if node.link == UNUSED {
                    continue;
                }
                assert!((node.parent == NOWHERE) == (place == 0), "{number} {tick}: {node:?}");
                let (first, count, is_leaf) = match Link::decode(node.link) {
                    Link::Children { first, count } => (first, count, false),
                    Link::Leaf { first, count } => (first, count, true),
                };
                for slot in (0..count).filter(|slot| node.apart & 1 << slot == 0) {
                    let link = if is_leaf {
                        Link::Leaf { first: first + slot, count: 1 }
                    } else {
                        tree.node(first + slot).expect("a node").2
                    };
                    let left = node.keys[slot as usize].wrapping_sub(now) as i32;
                    let bound = f64::from(unit.length(left));
                    let true_one = least(&tree, link, &far);
                    assert!(
                        bound <= true_one,
                        "{number} {tick}: {node:?} {slot}: {bound} {true_one}"
                    );
                    checked += 1;
                    positive += usize::from(left > 0);
                }
            }
        }
    }
    std::println!("{checked} bounds, {positive} of them above zero");
    assert!(positive > 10_000);
}

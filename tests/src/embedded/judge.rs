//! Searches a surface in a volume for failures, by climbing towards each kind: a vertex outside of its sphere, an answer
//! beyond its accuracy, and a frame admitted with an element stretched beyond its limit, or inverted.

use std::ops::AddAssign;

use dibs_nostd::nodes::Nodes;
use fastrand::Rng;
use glam::Vec3;

use super::answers::answer;
use super::receiver::{Memory, Receiver};
use super::{Carried, NodeMotion, Section, exact, nudged, pulled, rest, sections, stretch_of};
use crate::climb::climb;
use crate::deform::unit;
use crate::side_poses;

/// Counts of what was searched, and of failures.
#[derive(Clone, Copy, Default, Debug)]
pub struct Tally {
    /// Climbs towards a vertex outside of its sphere.
    pub climbs: usize,
    /// Those that found one.
    pub uncovered: usize,
    /// The largest distance of a vertex from its pin, relative to the stretched radius.
    pub farthest: f64,
    /// Queries.
    pub queries: usize,
    /// Answers off by more than their accuracy, those about the side included.
    pub wrong: usize,
    /// The largest error of an answer, relative to its accuracy.
    pub off: f64,
    /// Frames that a receiver admitted.
    pub admitted: usize,
    /// Frames that it refused.
    pub refused: usize,
    /// Admitted frames with an element beyond its limit, beyond the measured stretch, or inverted.
    pub beyond: usize,
    /// The largest stretch of an element in an admitted frame, relative to its limit.
    pub most: f64,
    /// Answers with a side.
    pub sides: side_poses::Tally,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.climbs += other.climbs;
        self.uncovered += other.uncovered;
        self.farthest = self.farthest.max(other.farthest);
        self.queries += other.queries;
        self.wrong += other.wrong;
        self.off = self.off.max(other.off);
        self.admitted += other.admitted;
        self.refused += other.refused;
        self.beyond += other.beyond;
        self.most = self.most.max(other.most);
        self.sides += other.sides;
    }
}

/// Climbs towards each kind of failure of a surface, and prints the failures.
///
/// # Panics
/// If a query or an admissible frame fails.
#[must_use]
pub fn judge(shape: &Carried, seed: u64) -> Tally {
    let mut rng = Rng::with_seed(seed);
    let mut tally = Tally::default();
    let tree = shape.built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let sections = sections(&tree);
    for _ in 0..2 {
        let section = &sections[rng.usize(..sections.len())];
        let share = cover(&nodes, section, 60, &mut rng);
        tally.climbs += 1;
        tally.farthest = tally.farthest.max(share);
        if share > 1.0 {
            tally.uncovered += 1;
            println!("{} {seed}: {share} of the radius, pin {}", shape.name, section.pin);
        }
    }
    admit(shape, &nodes, seed, &mut tally, &mut rng);
    answer(shape, &tree, &nodes, seed, &mut tally, &mut rng);
    tally.wrong += tally.sides.wrong;
    tally
}

/// A frame to climb from: at rest, moved, or pulled along a direction nearly up to the limit.
pub(super) fn start(nodes: &Nodes<'_>, along: Vec3, rng: &mut Rng) -> Vec<Vec3> {
    match rng.u32(..4) {
        0 => rest(nodes),
        1 => NodeMotion::ALL[rng.usize(..NodeMotion::ALL.len())].apply(nodes, rng),
        _ => {
            let mut strain = (nodes.stretch_limit() - 1.0) * 0.9999;
            loop {
                let frame = pulled(&rest(nodes), along, strain);
                if nodes.measure(frame.as_slice()).is_ok() {
                    return frame;
                }
                strain *= 0.8;
            }
        }
    }
}

/// The size of a change of a node that changes an element as much as its limit allows, or more.
pub(super) fn reach(nodes: &Nodes<'_>) -> f32 {
    let [a, b, ..] = nodes.element(0).expect("has elements");
    let at = |node| nodes.rest_position(node).expect("in the table");
    at(a).distance(at(b))
}

/// Climbs towards a vertex outside of a section's sphere, over frames that the check admits. Returns the distance of the
/// farthest vertex from the pin, relative to the stretched radius.
///
/// # Panics
/// Never: rows of a tree are in its tables.
#[must_use]
pub fn cover(nodes: &Nodes<'_>, section: &Section, steps: usize, rng: &mut Rng) -> f64 {
    let Section { pin, radius, covered } = section;
    let of = |row: &u32| nodes.weights(*row).expect("in the table").map(|(node, _)| node);
    let carriers: Vec<u32> = covered.iter().flat_map(of).collect();
    let away =
        |frame: &[Vec3], row: u32| exact(nodes, frame, row).distance(exact(nodes, frame, *pin));
    let at_rest = rest(nodes);
    let far = |row: &&u32| away(&at_rest, **row);
    let far = covered.iter().max_by(|a, b| far(a).total_cmp(&far(b))).expect("not empty");
    let along = exact(nodes, &at_rest, *far) - exact(nodes, &at_rest, *pin);
    let share = |frame: &Vec<Vec3>| {
        let sigma = f64::from(nodes.measure(frame.as_slice()).ok()?.sigma());
        let farthest = covered.iter().map(|&row| away(frame, row)).fold(0.0, f64::max);
        Some(farthest / (sigma * radius + 1e-9))
    };
    let from = start(nodes, along.as_vec3().normalize_or(Vec3::X), rng);
    let change = |frame: &Vec<Vec3>| nudged(nodes, frame, &carriers, reach(nodes), rng);
    climb(from, steps, change, share).1
}

/// Climbs towards a frame that a receiver admits although an element is stretched beyond its limit, or inverted: by the
/// singular values, in f64, of the nodes that the receiver has.
fn admit(shape: &Carried, nodes: &Nodes<'_>, seed: u64, tally: &mut Tally, rng: &mut Rng) {
    let memory = Memory::new(nodes);
    let mut receiver = Receiver::new(&memory, nodes);
    let most = f64::from(nodes.stretch_limit());
    let all: Vec<u32> = (0..nodes.count()).collect();
    let from = start(nodes, unit(rng), rng);
    let mut of_packets = rng.fork();
    let score = |frame: &Vec<Vec3>| {
        let Ok((now, sigma)) = receiver.receive(frame, &mut of_packets) else {
            tally.refused += 1;
            return None;
        };
        tally.admitted += 1;
        let part = |(corners, limit): (&[u32; 4], &f32)| {
            let rest = corners.map(|node| shape.volume.nodes()[node as usize].as_vec3());
            let (stretch, volume) = stretch_of(rest, corners.map(|node| now[node as usize]));
            // An element with a smaller limit must be below the same part of it.
            let limit = f64::from(*limit) * f64::from(sigma) / most;
            if volume > 0.0 { stretch / limit } else { f64::INFINITY }
        };
        let parts = shape.volume.tetrahedra().iter().zip(&shape.limits).map(part);
        // The maximum of NaN and a number is the number.
        let part = parts.map(|part| if part.is_nan() { f64::INFINITY } else { part });
        let part = part.fold(0.0, f64::max);
        tally.most = tally.most.max(part * f64::from(sigma) / most);
        if part > 1.0 {
            tally.beyond += 1;
            println!("{} {seed}: admitted at {part} of the limit", shape.name);
        }
        Some(part * f64::from(sigma))
    };
    let change = |frame: &Vec<Vec3>| nudged(nodes, frame, &all, reach(nodes), rng);
    let _ = climb(from, 40, change, score);
}

//! Searches a surface in a volume for failures, by climbing towards each kind: a vertex outside of its sphere, an answer
//! beyond its accuracy, and a frame admitted with an element stretched beyond its limit, or inverted.

use std::ops::AddAssign;

use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Capsule, MovingSurface, Odometer, Options, Proximity, Query, QueryError, Sphere, Tool, Tracker,
    Tree,
};
use fastrand::Rng;
use glam::{DVec3, Vec3};

use super::receiver::{Memory, Receiver};
use super::shapes::barycentric;
use super::{
    Carried, NodeMotion, Section, exact, nudged, pulled, rest, rows, sections, stretch_of,
};
use crate::climb::climb;
use crate::deform::unit;
use crate::oracle::{Instrument, exhaustive};
use crate::poses::pose;
use crate::{ask, side_poses, surfaces};

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
fn start(nodes: &Nodes<'_>, along: Vec3, rng: &mut Rng) -> Vec<Vec3> {
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
fn reach(nodes: &Nodes<'_>) -> f32 {
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

/// A tool beside a frame.
#[derive(Clone)]
struct Asked {
    frame: Vec<Vec3>,
    tool: Instrument,
}

/// Climbs towards an answer that is off by more than its accuracy, of every kind of query, one after another.
fn answer(
    shape: &Carried,
    tree: &Tree<'_, u16>,
    nodes: &Nodes<'_>,
    seed: u64,
    tally: &mut Tally,
    rng: &mut Rng,
) {
    let truth = Truth::new(shape, tree, nodes);
    let all: Vec<u32> = (0..nodes.count()).collect();
    let frame = start(nodes, unit(rng), rng);
    let positions = rows(&nodes.surface(frame.as_slice()));
    let mut tool = pose(&positions, &truth.triangles, rng);
    if rng.bool() {
        let from = side_poses::point(&positions, &truth.triangles, rng);
        tool = Instrument { start: from, end: from + (tool.end - tool.start), ..tool };
    }
    let is_signed = rng.bool() && is_closed(&truth.triangles);
    let mut machine = Machine::new(tree, nodes, &frame, is_signed);
    let score = |asked: &Asked| machine.ask(shape, &truth, asked, seed, tally);
    let change = |asked: &Asked| {
        let mut next = asked.clone();
        let by = unit(rng) * 30.0 * 10.0_f32.powf(-6.0 * rng.f32());
        let is_sphere = asked.tool.start == asked.tool.end;
        match rng.u32(..4) {
            0 => next.frame = nudged(nodes, &asked.frame, &all, reach(nodes), rng),
            1 => next.tool.end += by,
            2 if is_sphere => next.tool = Instrument::sphere(asked.tool.start + by, rng.f32()),
            2 => next.tool.start += by,
            _ => {
                next.tool.start += by;
                next.tool.end += by;
            }
        }
        next
    };
    let _ = climb(Asked { frame, tool }, 300, change, score);
}

/// The vertices as the nodes move them, in f64: by the barycentric coordinates of the mesh's own vertices, without the
/// rounding of the stored weights.
struct Truth {
    triangles: Vec<[u32; 3]>,
    places: Vec<([u32; 4], [f64; 4])>,
}

impl Truth {
    fn new(shape: &Carried, tree: &Tree<'_, u16>, nodes: &Nodes<'_>) -> Self {
        let place = |row| {
            let number = tree.vertex_number(row).expect("has an order").0;
            let corners = nodes.weights(row).expect("in the table").map(|(node, _)| node);
            let at_rest = corners.map(|node| nodes.rest_position(node).expect("in the table"));
            let at = shape.mesh.positions[number as usize].as_dvec3();
            (corners, barycentric(at_rest.map(Vec3::as_dvec3), at))
        };
        let places = (0..nodes.vertex_count()).map(place).collect();
        Self { triangles: surfaces::triangles(tree), places }
    }

    fn at(&self, frame: &[Vec3]) -> Vec<DVec3> {
        let blend = |(corners, weights): &([u32; 4], [f64; 4])| {
            let terms = corners.iter().zip(weights);
            terms.map(|(&node, weight)| frame[node as usize].as_dvec3() * weight).sum()
        };
        self.places.iter().map(blend).collect()
    }
}

/// Everything that answers: a query, and a tracker with its odometer.
struct Machine<'n, 't> {
    nodes: &'n Nodes<'t>,
    /// Whether the query and the tracker are asked for the side.
    is_signed: bool,
    query: Query<'t, u16, MAX_STACK>,
    tracker: Tracker<'t, u16, MAX_STACK, 96>,
    odometer: Odometer,
    before: Vec<Vec3>,
}

impl<'n, 't> Machine<'n, 't> {
    fn new(tree: &Tree<'t, u16>, nodes: &'n Nodes<'t>, frame: &[Vec3], is_signed: bool) -> Self {
        let mut odometer = nodes.odometer();
        let _ = odometer.start(frame);
        Self {
            nodes,
            is_signed,
            query: Query::new(tree).expect("deep enough"),
            tracker: Tracker::new(tree).expect("deep enough"),
            odometer,
            before: frame.to_vec(),
        }
    }

    /// Asks every kind of query. Returns the largest error relative to its accuracy; `None` for a refused frame.
    fn ask(
        &mut self,
        shape: &Carried,
        truth: &Truth,
        Asked { frame, tool }: &Asked,
        seed: u64,
        tally: &mut Tally,
    ) -> Option<f64> {
        let measured = self.nodes.measure(frame.as_slice()).ok()?;
        let step = self.odometer.step(self.before.as_slice(), frame.as_slice());
        let moved = step.after();
        let surface = self.nodes.surface(&moved);
        let positions = truth.at(frame);
        let pair = exhaustive(&positions, &truth.triangles, tool).expect("has triangles");
        let warm = Options::new().stretch(measured);
        let last = if self.is_signed { warm } else { warm.unsigned() };
        let [asked, tracked] = if tool.start == tool.end {
            let sphere = Sphere::new(tool.start, tool.radius).expect("valid");
            follow(&mut self.query, &mut self.tracker, &surface, &sphere, &last)
        } else {
            let capsule = Capsule::new(tool.start, tool.end, tool.radius).expect("valid");
            follow(&mut self.query, &mut self.tracker, &surface, &capsule, &last)
        };
        let query = &mut self.query;
        let answers = [
            ("with the limit", false, ask::closest(query, &surface, tool, &Options::cold())),
            ("measured", false, ask::closest(query, &surface, tool, &warm)),
            ("wide", false, ask::closest_wide(query, &surface, tool, &warm)),
            ("asked", self.is_signed, asked),
            ("tracked", self.is_signed, tracked),
        ];
        let mut worst = 0.0_f64;
        for (kind, is_signed, answer) in answers {
            tally.queries += 1;
            match answer {
                Ok(found) if is_signed => {
                    let sides = &mut tally.sides;
                    sides.judge(shape.name, &positions, &truth.triangles, tool, &pair, &found);
                }
                Ok(found) => {
                    let error = (pair.separation - f64::from(found.separation)).abs();
                    let part = error / f64::from(found.accuracy);
                    worst = worst.max(part);
                    // Written so that NaN is wrong.
                    if !(part <= 1.0) {
                        tally.wrong += 1;
                        println!("{} {seed}: {kind}: {part} of {found:?} {tool:?}", shape.name);
                    }
                }
                Err(error) => {
                    tally.wrong += 1;
                    println!("{} {seed}: {kind}: {error} {tool:?}", shape.name);
                }
            }
        }
        tally.off = tally.off.max(worst);
        self.before.clone_from(frame);
        Some(worst)
    }
}

/// The answers of a query and of a tracker.
fn follow<'t, S: MovingSurface, T: Tool>(
    query: &mut Query<'t, u16, MAX_STACK>,
    tracker: &mut Tracker<'t, u16, MAX_STACK, 96>,
    surface: &S,
    tool: &T,
    options: &Options,
) -> [Result<Proximity, QueryError>; 2] {
    let asked = query.closest(surface, tool, options);
    [asked, tracker.closest(surface, tool, options).map(|answer| answer.closest)]
}

/// Whether each edge has a triangle on either side.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let edges = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let mut all: Vec<[u32; 2]> = triangles.iter().flat_map(edges).collect();
    all.sort_unstable();
    all.iter().all(|&[from, to]| all.binary_search(&[to, from]).is_ok())
}

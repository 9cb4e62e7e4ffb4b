//! Climbs towards an answer that is off by more than its accuracy.

use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Capsule, MovingSurface, Odometer, Options, Proximity, Query, QueryError, Sphere, SurfaceBlend,
    Tool, Tracker, Tree,
};
use fastrand::Rng;
use glam::{DVec3, Vec3};

use super::judge::{Tally, reach, start};
use super::shapes::barycentric;
use super::{Carried, nudged, rows};
use crate::climb::climb;
use crate::deform::unit;
use crate::oracle::{Instrument, exhaustive};
use crate::poses::pose;
use crate::{ask, side_poses, surfaces};

/// A tool beside a frame.
#[derive(Clone)]
struct Asked {
    frame: Vec<Vec3>,
    tool: Instrument,
}

/// Climbs towards an answer that is off by more than its accuracy, of every kind of query, one after another.
pub(super) fn answer(
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
    let mut machine = Machine::new(tree, nodes, &frame, is_signed, rng.fork());
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
    rng: Rng,
}

impl<'n, 't> Machine<'n, 't> {
    fn new(
        tree: &Tree<'t, u16>,
        nodes: &'n Nodes<'t>,
        frame: &[Vec3],
        is_signed: bool,
        rng: Rng,
    ) -> Self {
        let mut odometer = nodes.odometer();
        let _ = odometer.start(frame);
        Self {
            nodes,
            is_signed,
            query: Query::new(tree).expect("deep enough"),
            tracker: Tracker::new(tree).expect("deep enough"),
            odometer,
            before: frame.to_vec(),
            rng,
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
        let warm = Options::new().stretch(measured);
        let positions = truth.at(frame);
        let Self { nodes, query, tracker, .. } = self;
        // A surface between the frames comes before the second one, an extrapolated one after it.
        let (share, is_between) = (self.rng.f32(), self.rng.bool());
        let blend = if is_between { step.at(share) } else { step.beyond(share) };
        let early = is_between.then(|| ask_blend(nodes, query, tracker, &blend, tool));
        let moved = step.after();
        let surface = nodes.surface(&moved);
        let last = if self.is_signed { warm } else { warm.unsigned() };
        let [asked, tracked] = ask_both(query, tracker, &surface, tool, &last);
        let answers = [
            ("with the limit", false, ask::closest(query, &surface, tool, &Options::cold())),
            ("measured", false, ask::closest(query, &surface, tool, &warm)),
            ("batched", false, ask::closest_batched(query, &surface, tool, &warm)),
            ("asked", self.is_signed, asked),
            ("tracked", self.is_signed, tracked),
        ];
        let late = (!is_between).then(|| ask_blend(nodes, query, tracker, &blend, tool));
        let mut judge = Judge { shape, triangles: &truth.triangles, tool, seed, tally, worst: 0.0 };
        judge.judge(&positions, answers);
        if let Some([asked, tracked]) = early.or(late).flatten() {
            let (t, before) = (f64::from(blend.t()), truth.at(&self.before));
            let at = |(&from, &to): (&DVec3, &DVec3)| from + (to - from) * t;
            let positions: Vec<DVec3> = before.iter().zip(&positions).map(at).collect();
            let answers = [("a blend, asked", false, asked), ("a blend, tracked", false, tracked)];
            judge.judge(&positions, answers);
        }
        let worst = judge.worst;
        tally.off = tally.off.max(worst);
        self.before.clone_from(frame);
        Some(worst)
    }
}

type Answer = Result<Proximity, QueryError>;

/// Compares answers about one tool with the truth.
struct Judge<'a> {
    shape: &'a Carried,
    triangles: &'a [[u32; 3]],
    tool: &'a Instrument,
    seed: u64,
    tally: &'a mut Tally,
    /// The largest error relative to its accuracy.
    worst: f64,
}

impl Judge<'_> {
    /// Answers of these kinds, with or without side, about a surface at these positions.
    fn judge<const N: usize>(&mut self, positions: &[DVec3], answers: [(&str, bool, Answer); N]) {
        let Self { shape: Carried { name, .. }, triangles, tool, seed, tally, .. } = self;
        let pair = exhaustive(positions, triangles, tool).expect("has triangles");
        for (kind, is_signed, answer) in answers {
            tally.queries += 1;
            match answer {
                Ok(found) if is_signed => {
                    let off = tally.sides.judge(name, positions, triangles, tool, &pair, &found);
                    self.worst = off.map_or(self.worst, |off| self.worst.max(off));
                }
                Ok(found) => {
                    let error = (pair.separation - f64::from(found.separation)).abs();
                    let part = error / f64::from(found.accuracy);
                    self.worst = self.worst.max(part);
                    // Written so that NaN is wrong.
                    if !(part <= 1.0) {
                        tally.wrong += 1;
                        println!("{name} {seed}: {kind}: {part} of {found:?} {tool:?}");
                    }
                }
                Err(error) => {
                    tally.wrong += 1;
                    println!("{name} {seed}: {kind}: {error} {tool:?}");
                }
            }
        }
    }
}

/// The answers of a query and of a tracker about a surface between two frames or after them; `None` if an element is
/// stretched beyond its limit there, or inverted.
fn ask_blend<'t>(
    nodes: &Nodes<'_>,
    query: &mut Query<'t, u16, MAX_STACK>,
    tracker: &mut Tracker<'t, u16, MAX_STACK, 96>,
    blend: &SurfaceBlend<'_, [Vec3], [Vec3]>,
    tool: &Instrument,
) -> Option<[Answer; 2]> {
    let options = Options::new().stretch(nodes.measure(blend).ok()?).unsigned();
    Some(ask_both(query, tracker, &nodes.surface(blend), tool, &options))
}

/// The answers of a query and of a tracker.
fn ask_both<'t, S: MovingSurface>(
    query: &mut Query<'t, u16, MAX_STACK>,
    tracker: &mut Tracker<'t, u16, MAX_STACK, 96>,
    surface: &S,
    tool: &Instrument,
    options: &Options,
) -> [Answer; 2] {
    if tool.start == tool.end {
        let sphere = Sphere::new(tool.start, tool.radius).expect("valid");
        follow(query, tracker, surface, &sphere, options)
    } else {
        let capsule = Capsule::new(tool.start, tool.end, tool.radius).expect("valid");
        follow(query, tracker, surface, &capsule, options)
    }
}

fn follow<'t, S: MovingSurface, T: Tool>(
    query: &mut Query<'t, u16, MAX_STACK>,
    tracker: &mut Tracker<'t, u16, MAX_STACK, 96>,
    surface: &S,
    tool: &T,
    options: &Options,
) -> [Answer; 2] {
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

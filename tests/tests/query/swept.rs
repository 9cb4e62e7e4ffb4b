//! Sweeps compared with dense sampling in f64: no contact may be missed.
//!
//! One file, because all motions are checked in one way.

// Requirement: A-10

use std::env;

use dibs_build::{Builder, Mesh};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Budget, Capsule, Odometer, Options, QueryError, Sphere, Step, Sweep, SweepAnswer, Tool,
    Tracker, VertexTable, measure_stretch,
};
use dibs_tests::climb::climb;
use dibs_tests::deform::unit;
use dibs_tests::embedded::{Carried, NodeMotion, all, exact, rest};
use dibs_tests::oracle::{Instrument, least_distance};
use dibs_tests::{sample, surfaces};
use fastrand::Rng;
use glam::{DQuat, DVec3, Vec3};

/// The number of ticks: `DIBS_SWEPT_TICKS`, if set.
fn ticks() -> usize {
    env::var("DIBS_SWEPT_TICKS").map_or(400, |text| text.parse().expect("a number of ticks"))
}

/// Number of times in a tick at which the true separation is computed in f64.
const INSTANTS: usize = 40;
const SAMPLES: u32 = 32;
const RADIUS: f32 = 1.0;

type Follower<'t> = Tracker<'t, u16, MAX_STACK, 256>;

/// A sheet without thickness, of this size, with `2 * cells^2` triangles.
fn sheet(size: f32, cells: u32) -> Mesh {
    let side = cells + 1;
    let at = |i: u32| i as f32 / cells as f32 * size - size / 2.0;
    let positions = (0..side * side).map(|v| Vec3::new(at(v % side), at(v / side), 0.0)).collect();
    let cell = |i: u32| {
        let corner = i / cells * side + i % cells;
        [[corner, corner + 1, corner + side], [corner + 1, corner + side + 1, corner + side]]
    };
    Mesh { positions, triangles: (0..cells * cells).flat_map(cell).collect(), ..Mesh::default() }
}

/// The motion of a mesh as a whole: about a centre that moves in a straight line, at a constant rate.
#[derive(Clone, Copy, Debug)]
struct Turning {
    first: DQuat,
    /// Axis times angle from start to end.
    by: DVec3,
    /// In mesh coordinates, and at start and end in the world.
    centre: DVec3,
    ways: [DVec3; 2],
}

impl Turning {
    fn random(size: f32, rng: &mut Rng) -> Self {
        let mut any = |most: f32| unit(rng).as_dvec3() * f64::from(rng.f32() * most);
        let (first, by, centre) = (DQuat::from_scaled_axis(any(3.0)), any(0.6), any(size * 0.3));
        let from = any(size * 4.0);
        Self { first, by, centre, ways: [from, from + any(size * 0.3)] }
    }

    /// A point of the world in mesh coordinates, at a fraction of the time.
    fn inverse(&self, time: f64, point: DVec3) -> DVec3 {
        let [from, to] = self.ways;
        let turned = DQuat::from_scaled_axis(self.by * time) * self.first;
        turned.inverse() * (point - from.lerp(to, time)) + self.centre
    }

    /// Where a point of the mesh is at the start.
    fn at_start(&self, point: DVec3) -> DVec3 {
        self.first * (point - self.centre) + self.ways[0]
    }

    /// The bound in `Sweep`'s documentation on the distance of a point's path from its chord.
    fn arc(&self, ways: &[[DVec3; 2]]) -> f64 {
        let (mut lever, mut shift, angle) = (0.0_f64, 0.0_f64, self.by.length());
        for &[from, to] in ways {
            let [before, after] = [from - self.ways[0], to - self.ways[1]];
            lever = lever.max(before.length()).max(after.length());
            shift = shift.max((after - before).length());
        }
        angle * (angle * lever + 2.0 * shift) / 8.0
    }
}

/// One tick: the surface's frames, and the tool at both ends.
struct Way<'a> {
    frames: [&'a [DVec3]; 2],
    triangles: &'a [[u32; 3]],
    t: [f32; 2],
    ends: [Instrument; 2],
    margin: f32,
    /// The tool's ends are then in the world.
    turning: Option<Turning>,
}

impl Way<'_> {
    fn separation(&self, time: f64) -> f64 {
        let [first, last] = self.t.map(f64::from);
        let share = first + time * (last - first);
        let [from, to] = &self.ends;
        let local = |[from, to]: [Vec3; 2]| {
            let point = from.as_dvec3().lerp(to.as_dvec3(), time);
            self.turning.map_or(point, |turning| turning.inverse(time, point))
        };
        let (start, end) = (local([from.start, to.start]), local([from.end, to.end]));
        let [before, after] = self.frames;
        let rows: Vec<DVec3> =
            before.iter().zip(after).map(|(before, &after)| before.lerp(after, share)).collect();
        let triangles = self.triangles.iter().map(|corners| corners.map(|v| rows[v as usize]));
        least_distance(start, end, triangles) - f64::from(RADIUS)
    }

    /// What the tool's way leaves its straight line by, in mesh coordinates.
    fn arc(&self) -> f64 {
        let [from, to] = self.ends.map(|end| [end.start, end.end].map(Vec3::as_dvec3));
        let ways = [[from[0], to[0]], [from[1], to[1]]];
        self.turning.map_or(0.0, |turning| turning.arc(&ways))
    }

    fn sweep<W: VertexTable + ?Sized, V: VertexTable + ?Sized>(
        &self,
        tracker: &mut Follower<'_>,
        step: &Step<'_, W, V>,
        options: &Options,
    ) -> Result<SweepAnswer, QueryError> {
        let local = |time: f64, point: Vec3| {
            self.turning.map_or(point, |turning| turning.inverse(time, point.as_dvec3()).as_vec3())
        };
        let [from, to] = self.ends;
        let ends = [(0.0, from), (1.0, to)]
            .map(|(time, end)| [local(time, end.start), local(time, end.end)]);
        let (t, margin) = (self.t, self.margin + self.arc() as f32);
        if from.start == from.end {
            let tools = ends.map(|[start, _]| Sphere::new(start, RADIUS).expect("valid"));
            tracker.sweep(&Sweep { step, t, tools }, margin, SAMPLES, options)
        } else {
            let tools = ends.map(|[start, end]| Capsule::new(start, end, RADIUS).expect("valid"));
            tracker.sweep(&Sweep { step, t, tools }, margin, SAMPLES, options)
        }
    }
}

#[derive(Debug, Default)]
struct Tally {
    clear: usize,
    contacts: usize,
    undecided: usize,
    samples: usize,
}

impl Tally {
    /// Compares a sweep with the true separation at many times.
    fn check(&mut self, way: &Way<'_>, found: &SweepAnswer) {
        let margin = f64::from(way.margin);
        // The accuracy, plus the rounding of f32 coordinates of this size.
        let points = way.ends.iter().flat_map(|end| [end.start, end.end]);
        let size = points.map(|p| f64::from(p.length())).fold(0.0, f64::max);
        let spare = 1.5 * f64::from(found.at_end.accuracy) + 2e-5 * size + 2.0 * way.arc();
        // The rounding of a tool that is led to the mesh is its caller's.
        let led = if way.turning.is_some() { 1e-6 * size } else { 0.0 };
        let until = f64::from(found.clear_until);
        for instant in 0..=INSTANTS {
            let time = instant as f64 / INSTANTS as f64;
            if time < until {
                let apart = way.separation(time);
                assert!(apart >= margin - led, "{time}: {apart} {margin} {found:?} {:?}", way.ends);
            }
        }
        if let Some(time) = found.contact {
            let apart = way.separation(f64::from(time));
            assert!(apart <= margin + spare, "{apart} {spare} {found:?}");
            assert!(time >= found.clear_until, "{found:?}");
            self.contacts += 1;
        } else if found.clear_until > 1.0 {
            self.clear += 1;
        } else {
            self.undecided += 1;
        }
        assert!((1..=SAMPLES).contains(&found.samples), "{found:?}");
        self.samples += found.samples as usize;
    }
}

/// The tool at both ends of a motion: through the surface, along it at about the margin, or random.
fn ends(rest: &[Vec3], size: f32, margin: f32, rng: &mut Rng) -> [Instrument; 2] {
    let target = rest[rng.usize(..rest.len())];
    let across = unit(rng);
    let (from, to) = match rng.u32(..4) {
        0 => (target + across * size * 0.5, target - across * size * 0.5),
        // The tool is much faster than the surface.
        1 => (target + across * size * 20.0, target - across * size * 20.0),
        2 => {
            let aside = Vec3::Z * (RADIUS + margin + 0.02 * (rng.f32() - 0.5));
            let along = Vec3::new(across.x, across.y, 0.0) * size * 0.3;
            (target + aside + along, target + aside - along)
        }
        _ => (target + across * size * rng.f32(), target + unit(rng) * size * rng.f32()),
    };
    let span = unit(rng) * size * 0.3;
    if rng.bool() {
        [from, to].map(|point| Instrument::sphere(point, RADIUS))
    } else {
        let turned = Vec3::new(span.y, span.z, span.x);
        [(from, span), (to, turned)].map(|(p, span)| Instrument::capsule(p, p + span, RADIUS))
    }
}

/// Ticks of vertices, of a mesh that stays where it is or also turns and shifts as a whole.
fn sweep_vertices(seed: u64, is_turning: bool) {
    let mut rng = Rng::with_seed(seed);
    let mut tally = Tally::default();
    for mesh in [sheet(60.0, 8), surfaces::ball(2)] {
        let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let rest = built.to_rows(&mesh.positions);
        let size = rest.iter().map(|p| p.length()).fold(0.0, f32::max);
        let mut tracker = Follower::new(&tree).expect("enough");
        let mut odometer = Odometer::new(&tree);
        let mut before = rest.clone();
        for _ in 0..ticks() / 2 {
            // The whole surface moves, slowly or fast, and bends a little.
            let by = unit(&mut rng) * size * [0.0, 0.01, 0.3][rng.usize(..3)] * rng.f32();
            let bend = rng.f32() * 0.1;
            let after: Vec<Vec3> =
                rest.iter().map(|&p| p + by + Vec3::Z * bend * (p.x * 0.1).sin()).collect();
            let stretch_of = |rows: &[Vec3]| measure_stretch(&tree, rows).expect("within limits");
            let step = odometer.step(before.as_slice(), after.as_slice());
            let both = stretch_of(&before).or_larger(stretch_of(&after)).expect("one tree");
            let margin = rng.f32() * [0.0, 2.0][rng.usize(..2)];
            let exact = |rows: &[Vec3]| rows.iter().map(|row| row.as_dvec3()).collect::<Vec<_>>();
            let frames = [exact(&before), exact(&after)];
            let mut ends = ends(&rest, size, margin, &mut rng);
            let turning = is_turning.then(|| Turning::random(size, &mut rng));
            if let Some(turning) = &turning {
                for point in ends.iter_mut().flat_map(|end| [&mut end.start, &mut end.end]) {
                    *point = turning.at_start(point.as_dvec3()).as_vec3();
                }
            }
            let way = Way {
                frames: frames.each_ref().map(Vec::as_slice),
                triangles: &triangles,
                t: [[0.0, 1.0], [0.25, 0.5], [0.5, 0.5]][rng.usize(..3)],
                ends,
                margin,
                turning,
            };
            let mut options = Options::new().stretch(both);
            if rng.bool() {
                options = options.unsigned();
            }
            if rng.u32(..8) == 0 {
                options = options.budget(Budget::new(rng.u32(..108)));
            }
            let found = way.sweep(&mut tracker, &step, &options).expect("an answer");
            tally.check(&way, &found);
            before = after;
        }
    }
    println!("{tally:?}");
    let all = tally.clear + tally.contacts + tally.undecided;
    assert!(tally.clear > all / 10 && tally.contacts > all / 10, "{tally:?}");
    // Along the surface at the margin each search rules out little, so some motions stay undecided.
    assert!(tally.undecided < all / 2, "{tally:?}");
}

#[test]
fn nothing_is_jumped_over() {
    sweep_vertices(31, false);
}

#[test]
fn a_mesh_that_turns_is_swept_by_its_lever() {
    sweep_vertices(32, true);
}

/// Climbs towards a point whose path in mesh coordinates is farther from its chord than stated.
#[test]
fn an_arc_leaves_its_chord_by_less_than_stated() {
    let mut rng = Rng::with_seed(33);
    let mut highest = 0.0_f64;
    for _ in 0..sample(200) {
        let mut vary = Rng::with_seed(rng.u64(..));
        let start = (Turning::random(50.0, &mut rng), [(); 2].map(|()| unit(&mut rng).as_dvec3()));
        let change = |&(turning, ends): &(Turning, [DVec3; 2])| {
            let mut by = |size: f64| unit(&mut vary).as_dvec3() * vary.f64().powi(3) * size;
            let ways = turning.ways.map(|way| way + by(10.0));
            let next = Turning { by: turning.by + by(0.2), ways, ..turning };
            (next, ends.map(|end| end + by(50.0)))
        };
        let score = |(turning, [from, to]): &(Turning, [DVec3; 2])| {
            let at = |time: f64| turning.inverse(time, from.lerp(*to, time));
            let chord = |time: f64| at(0.0).lerp(at(1.0), time);
            let off = (1..40).map(|step| f64::from(step) / 40.0);
            let off = off.map(|time| at(time).distance(chord(time))).fold(0.0, f64::max);
            Some(off / turning.arc(&[[*from, *to]]))
        };
        let (_, found) = climb(start, 300, change, score);
        assert!(found <= 1.0, "{found}");
        highest = highest.max(found);
    }
    assert!(highest > 0.9, "{highest}");
}

/// Steps of nodes: their motion bounds that of each vertex, also of one outside of its element.
#[test]
fn nodes_are_swept() {
    let mut rng = Rng::with_seed(34);
    let mut tally = Tally::default();
    for Carried { built, .. } in all(&mut rng) {
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let triangles = surfaces::triangles(&tree);
        let mut tracker = Follower::new(&tree).expect("enough");
        let mut odometer = nodes.odometer();
        let mut before = rest(&nodes);
        // The vertex that moves most for a millimetre of its nodes.
        let lever = |row: u32| -> Option<i32> {
            nodes.weights(row).map(|weights| weights.iter().map(|(_, weight)| weight.abs()).sum())
        };
        let levered = (0..nodes.vertex_count()).max_by_key(|&row| lever(row)).expect("vertices");
        for tick in 0..ticks() / 20 {
            let kind = NodeMotion::ALL[tick % NodeMotion::ALL.len()];
            let mut after = kind.apply(&nodes, &mut rng);
            if tick % 4 == 0 {
                after.clone_from(&before);
                for (node, weight) in nodes.weights(levered).expect("in the table") {
                    after[node as usize].x += 0.2_f32.copysign(weight as f32);
                }
            }
            let measured = [&before, &after].map(|frame| nodes.measure(frame.as_slice()));
            let [Ok(old), Ok(new)] = measured else { continue };
            let frames = [&before, &after].map(|frame| {
                (0..nodes.vertex_count()).map(|row| exact(&nodes, frame, row)).collect::<Vec<_>>()
            });
            let surfaces = [&before, &after].map(|frame| nodes.surface(frame.as_slice()));
            let step = surfaces[0].step(&surfaces[1], &mut odometer);
            let far = frames[0].iter().zip(&frames[1]).map(|(old, new)| old.distance(*new));
            let far = far.fold(0.0, f64::max);
            assert!(f64::from(step.length()) >= far, "{kind:?}: {} {far}", step.length());
            let at: Vec<Vec3> = frames[0].iter().map(|at| at.as_vec3()).collect();
            let size = at.iter().map(|row| row.distance(at[0])).fold(0.0, f32::max);
            let margin = rng.f32() * [0.0, 2.0][rng.usize(..2)];
            let way = Way {
                frames: frames.each_ref().map(Vec::as_slice),
                triangles: &triangles,
                t: [[0.0, 1.0], [0.25, 0.5]][rng.usize(..2)],
                ends: ends(&at, size, margin, &mut rng),
                margin,
                turning: None,
            };
            let both = old.or_larger(new).expect("one tree");
            let found = way.sweep(&mut tracker, &step, &Options::new().stretch(both));
            tally.check(&way, &found.expect("an answer"));
            before = after;
        }
    }
    println!("{tally:?}");
    let all = tally.clear + tally.contacts + tally.undecided;
    assert!(tally.clear > all / 10 && tally.contacts > all / 10, "{tally:?}");
}

#[test]
fn hostile_ways_are_refused_or_never_cleared() {
    let mesh = sheet(60.0, 8);
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rest = built.to_rows(&mesh.positions);
    let mut tracker = Follower::new(&tree).expect("enough");
    let mut odometer = Odometer::new(&tree);
    let at = |z: f32| Sphere::new(Vec3::Z * z, RADIUS).expect("valid");
    let still = odometer.step(rest.as_slice(), rest.as_slice());
    let options = Options::cold();
    let mut ask = |step: &Step<'_, [Vec3], [Vec3]>, t, [from, to]: [f32; 2], margin| {
        let sweep = Sweep { step, t, tools: [at(from), at(to)] };
        tracker.sweep(&sweep, margin, SAMPLES, &options)
    };
    for margin in [f32::NAN, -1.0, f32::INFINITY] {
        let refused = QueryError::Margin { bits: margin.to_bits() };
        assert_eq!(ask(&still, [0.0, 1.0], [9.0, 8.0], margin), Err(refused));
    }
    for outside in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
        let refused = QueryError::BlendTime { bits: outside.to_bits() };
        assert_eq!(ask(&still, [outside, 1.0], [9.0, 8.0], 1.0), Err(refused));
        assert_eq!(ask(&still, [0.0, outside], [9.0, 8.0], 1.0), Err(refused));
    }
    // Nothing moves: one search decides.
    let found = ask(&still, [0.3, 0.3], [9.0, 9.0], 1.0).expect("an answer");
    assert!(found.clear_until > 1.0 && found.contact.is_none() && found.samples == 1, "{found:?}");
    let found = ask(&still, [0.3, 0.3], [1.5, 1.5], 1.0).expect("an answer");
    assert_eq!((found.clear_until, found.contact), (0.0, Some(0.0)), "{found:?}");
    // From one end of f32's range to the other, through a sheet.
    let found = ask(&still, [0.0, 1.0], [5e8, -5e8], 0.0).expect("an answer");
    assert!(found.clear_until < 0.5, "{found:?}");
    // One vertex is not finite: the surface's motion is unknown.
    let mut torn = rest.clone();
    torn[0] = Vec3::NAN;
    let mut odometer = Odometer::new(&tree);
    let torn = odometer.step(rest.as_slice(), torn.as_slice());
    let found = ask(&torn, [0.0, 1.0], [9.0, 8.0], 1.0);
    let is_unclear = match &found {
        Ok(found) => found.clear_until <= 0.0,
        Err(error) => matches!(error, QueryError::Position { .. }),
    };
    assert!(is_unclear, "{found:?}");
}

/// A sweep over a surface at rest.
fn sweep_at_rest<T: Tool>(
    tracker: &mut Follower<'_>,
    step: &Step<'_, [Vec3], [Vec3]>,
    tools: [T; 2],
) -> SweepAnswer {
    let sweep = Sweep { step, t: [0.0, 1.0], tools };
    tracker.sweep(&sweep, 0.0, SAMPLES, &Options::cold()).expect("an answer")
}

/// Of the radii at start and end the larger counts all the way.
#[test]
fn a_tool_has_the_larger_of_its_radii_throughout() {
    let mesh = sheet(60.0, 8);
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rest = built.to_rows(&mesh.positions);
    let mut tracker = Follower::new(&tree).expect("enough");
    let mut odometer = Odometer::new(&tree);
    let still = odometer.step(rest.as_slice(), rest.as_slice());
    let sphere = |(z, radius): (f32, f32)| Sphere::new(Vec3::Z * z, radius).expect("valid");
    let capsule = |(z, radius): (f32, f32)| {
        let ends = [-5.0, 5.0].map(|x| Vec3::new(x, 0.0, z));
        Capsule::new(ends[0], ends[1], radius).expect("valid")
    };
    for (height, touches) in [(2.5, true), (3.5, false)] {
        for [from, to] in [[0.5, 3.0], [3.0, 0.5]] {
            let ways = [(height, from), (9.0, to)];
            let by_sphere = sweep_at_rest(&mut tracker, &still, ways.map(sphere));
            let by_capsule = sweep_at_rest(&mut tracker, &still, ways.map(capsule));
            for found in [by_sphere, by_capsule] {
                if touches {
                    assert_eq!((found.clear_until, found.contact), (0.0, Some(0.0)), "{found:?}");
                } else {
                    assert!(found.clear_until > 1.0 && found.contact.is_none(), "{found:?}");
                }
            }
        }
    }
}

/// Nothing moves, so any positive distance rules out contact; a budget that shows none is no error.
#[test]
fn a_sweep_at_rest_needs_no_budget() {
    let mesh = dibs_build::generate::heart(1_000).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut odometer = Odometer::new(&tree);
    let step = odometer.step(rows.as_slice(), rows.as_slice());
    let mut rng = Rng::with_seed(11);
    let (mut cleared, mut open) = (0, 0);
    for _ in 0..2_000 {
        let mut tracker = Follower::new(&tree).expect("deep enough");
        let tool = Sphere::new(unit(&mut rng) * 120.0, 0.0).expect("valid");
        let budget = Budget::new(rng.u32(..140));
        let sweep = Sweep { step: &step, t: [0.0, 0.0], tools: [tool, tool] };
        let swept = tracker.sweep(&sweep, 1.0, 10, &Options::new().budget(budget));
        let swept = swept.expect("a short budget is no error");
        assert!(swept.clear_until.is_finite() && swept.samples <= 10, "{swept:?}");
        cleared += usize::from(swept.clear_until >= 1.0);
        open += usize::from(swept.clear_until < 1.0);
    }
    assert!(cleared > 100 && open > 100, "{cleared} {open}");
}

//! Sweeps compared with dense sampling in f64: no contact may be missed.

// Requirement: A-10

use std::env;

use dibs_build::{Builder, Mesh};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Odometer, Options, QueryError, Sphere, Step, Sweep, SweepAnswer, Tool,
    Tracker, measure_stretch,
};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{Instrument, least_distance};
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::{DVec3, Vec3};

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

/// One tick: the surface's frames, and the tool at both ends.
struct Way<'a> {
    frames: [&'a [Vec3]; 2],
    triangles: &'a [[u32; 3]],
    t: [f32; 2],
    ends: [Instrument; 2],
    margin: f32,
}

impl Way<'_> {
    fn separation(&self, time: f64) -> f64 {
        let [first, last] = self.t.map(f64::from);
        let share = first + time * (last - first);
        let between = |from: Vec3, to: Vec3, share: f64| {
            from.as_dvec3() + (to.as_dvec3() - from.as_dvec3()) * share
        };
        let [from, to] = &self.ends;
        let (start, end) = (between(from.start, to.start, time), between(from.end, to.end, time));
        let at =
            |row: u32| between(self.frames[0][row as usize], self.frames[1][row as usize], share);
        let rows: Vec<DVec3> = (0..self.frames[0].len() as u32).map(at).collect();
        let triangles = self.triangles.iter().map(|corners| corners.map(|v| rows[v as usize]));
        least_distance(start, end, triangles) - f64::from(RADIUS)
    }

    fn sweep(
        &self,
        tracker: &mut Follower<'_>,
        step: &Step<'_, [Vec3], [Vec3]>,
        options: &Options,
    ) -> Result<SweepAnswer, QueryError> {
        fn ask<T: Tool>(
            tracker: &mut Follower<'_>,
            step: &Step<'_, [Vec3], [Vec3]>,
            (t, tools): ([f32; 2], [T; 2]),
            margin: f32,
            options: &Options,
        ) -> Result<SweepAnswer, QueryError> {
            tracker.sweep(&Sweep { step, t, tools }, margin, SAMPLES, options)
        }
        if self.ends[0].start == self.ends[0].end {
            let tools = self.ends.map(|end| Sphere::new(end.start, RADIUS).expect("valid"));
            ask(tracker, step, (self.t, tools), self.margin, options)
        } else {
            let tools = self.ends.map(|end| Capsule::new(end.start, end.end, RADIUS));
            let tools = tools.map(|tool| tool.expect("valid"));
            ask(tracker, step, (self.t, tools), self.margin, options)
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
        let spare = 1.5 * f64::from(found.at_end.accuracy) + 2e-5 * size;
        let until = f64::from(found.clear_until);
        for instant in 0..=INSTANTS {
            let time = instant as f64 / INSTANTS as f64;
            if time < until {
                let apart = way.separation(time);
                assert!(apart >= margin, "{time}: {apart} {margin} {found:?} {:?}", way.ends);
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

#[test]
fn nothing_is_jumped_over() {
    let mut rng = Rng::with_seed(31);
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
            let way = Way {
                frames: [&before, &after],
                triangles: &triangles,
                t: [[0.0, 1.0], [0.25, 0.5], [0.5, 0.5]][rng.usize(..3)],
                ends: ends(&rest, size, margin, &mut rng),
                margin,
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

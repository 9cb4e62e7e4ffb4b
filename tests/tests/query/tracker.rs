//! The tracker compared with complete queries: the same separation at every tick, for any motion of tool and surface.

// Requirement: T-01

use std::env;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Fallback, MeasuredStretch, MovingSurface, Odometer, Options, Query, Sphere,
    Tool, Tracker, TrackerAnswer, Tree, measure_stretch,
};
use dibs_tests::deform::{Deformation, unit};
use dibs_tests::method::Probe;
use dibs_tests::oracle::Instrument;
use dibs_tests::poses::pose;
use dibs_tests::streams::Beat;
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::Vec3;

/// The number of ticks of each test: `DIBS_TRACKER_TICKS`, if set, else `few`.
fn ticks(few: usize) -> usize {
    env::var("DIBS_TRACKER_TICKS").map_or(few, |text| text.parse().expect("a number of ticks"))
}

/// Counts of the ticks of a run.
#[derive(Debug, Default)]
struct Tally {
    ticks: usize,
    cut_short: usize,
    /// Ticks by the reason for a complete query: start, surface, jump, full, and none.
    fallbacks: [usize; 5],
    nodes: [u64; 2],
    /// Largest difference from the complete query, in units of the accuracy stated for both.
    worst: f32,
}

impl Tally {
    fn note(&mut self, found: &TrackerAnswer, whole_nodes: u32) {
        self.ticks += 1;
        let cause = match found.fallback {
            Some(Fallback::Start) => 0,
            Some(Fallback::Surface) => 1,
            Some(Fallback::Jump) => 2,
            Some(_) => 3,
            None => 4,
        };
        self.fallbacks[cause] += 1;
        self.nodes[0] += u64::from(found.closest.node_tests);
        self.nodes[1] += u64::from(whole_nodes);
    }
}

struct Subject<'t, const OPENED: usize> {
    query: Query<'t, u16, MAX_STACK>,
    tracker: Tracker<'t, u16, MAX_STACK, OPENED>,
    tally: Tally,
}

impl<'t, const OPENED: usize> Subject<'t, OPENED> {
    fn new(tree: &Tree<'t, u16>) -> Self {
        Self {
            query: Query::new(tree).expect("enough"),
            tracker: Tracker::new(tree).expect("enough"),
            tally: Tally::default(),
        }
    }

    /// Makes one tick, and compares it with a complete query.
    fn tick(
        &mut self,
        surface: &impl MovingSurface,
        tool: &Instrument,
        options: &Options,
        budget: Option<Budget>,
    ) {
        if tool.start == tool.end {
            let tool = Sphere::new(tool.start, tool.radius).expect("a valid sphere");
            self.ask(surface, &tool, options, budget);
        } else {
            let tool = Capsule::new(tool.start, tool.end, tool.radius).expect("a valid capsule");
            self.ask(surface, &tool, options, budget);
        }
    }

    fn ask(
        &mut self,
        surface: &impl MovingSurface,
        tool: &impl Tool,
        options: &Options,
        budget: Option<Budget>,
    ) {
        let whole = self.query.closest(surface, tool, options).expect("an answer");
        let asked = budget.map_or(*options, |budget| options.budget(budget));
        let tracked = self.tracker.closest(surface, tool, &asked).expect("an answer");
        let found = &tracked.closest;
        let accuracy = found.accuracy + whole.accuracy;
        if let Some(budget) = budget {
            assert!(
                found.lower - accuracy <= whole.separation
                    && whole.separation <= found.separation + accuracy,
                "{:?}: {tracked:?}\n{whole:?}",
                self.tally
            );
            // The root is not counted, and neither is a warm triangle.
            let most = budget.tests().saturating_add(1 + Budget::TRIANGLE);
            assert!(found.work() <= most, "{tracked:?} {budget:?}");
            self.tally.cut_short += usize::from(found.lower < found.separation);
        } else {
            let apart = (found.separation - whole.separation).abs() / accuracy;
            assert!(
                apart <= 1.0 && found.lower == found.separation,
                "{:?}: {tracked:?}\n{whole:?}",
                self.tally
            );
            self.tally.worst = self.tally.worst.max(apart);
        }
        self.tally.note(&tracked, whole.node_tests);
    }
}

/// The next frame: the same one, a random deformation of the mesh, or a rigid motion of the surface.
fn next_frame(built: &BuiltTree, mesh: &Mesh, before: &[Vec3], rng: &mut Rng) -> Vec<Vec3> {
    match rng.u32(..12) {
        0 => before.to_vec(),
        1 => {
            let deformation = Deformation::ALL[rng.usize(..Deformation::ALL.len())];
            let paths = built.tree::<u16>().expect("16-bit indices").paths();
            built.to_rows(&deformation.apply(mesh, paths, 1.4, rng))
        }
        // A rigid motion keeps the stretch.
        _ => {
            let by = unit(rng) * rng.f32() * if rng.u32(..8) == 0 { 5.0 } else { 0.5 };
            before.iter().map(|&p| p + by).collect()
        }
    }
}

fn next_tool(
    tool: &Instrument,
    rows: &[Vec3],
    triangles: &[[u32; 3]],
    rng: &mut Rng,
) -> Instrument {
    let walk = |tool: &Instrument, size: f32, rng: &mut Rng| {
        let (start, end) = (unit(rng) * rng.f32() * size, unit(rng) * rng.f32() * size);
        let end = if tool.start == tool.end { start } else { end };
        Instrument { start: tool.start + start, end: tool.end + end, radius: tool.radius }
    };
    match rng.u32(..60) {
        0 => pose(rows, triangles, rng),
        1 => walk(tool, 20.0, rng),
        2..6 => *tool,
        6..12 => walk(tool, 2.0, rng),
        // The tool is changed at the same place.
        12 => Instrument::sphere(tool.start, 1.0),
        _ => walk(tool, 0.3, rng),
    }
}

fn wander<const OPENED: usize>(mesh: &Mesh, ticks: usize, seed: u64) -> Tally {
    let mut rng = Rng::with_seed(seed);
    let built = Builder::new().stretch(1.5).build(mesh).expect("builds");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let triangles = surfaces::triangles(&tree);
    let mut subject = Subject::<OPENED>::new(&tree);
    let mut odometer = Odometer::new(&tree);
    let mut before = built.to_rows(&mesh.positions);
    let stretch_of = |rows: &[Vec3]| measure_stretch(&tree, rows).expect("within the limit");
    let mut stretch: MeasuredStretch = stretch_of(&before);
    let mut tool = pose(&before, &triangles, &mut rng);
    while subject.tally.ticks < ticks {
        let after = next_frame(&built, mesh, &before, &mut rng);
        let measured = stretch_of(&after);
        if rng.u32(..40) == 0 {
            // The odometer starts again: the motion to this frame is unknown.
            odometer.start(after.as_slice());
        }
        let step = odometer.step(before.as_slice(), after.as_slice());
        let both = stretch.or_larger(measured).expect("one tree");
        // With no tick, the frame is skipped.
        let ticks_of_frame = rng.u32(..20);
        for tick in 0..ticks_of_frame {
            tool = next_tool(&tool, &after, &triangles, &mut rng);
            let budget = (rng.u32(..10) == 0).then(|| Budget::new(rng.u32(..108)));
            let share = tick as f32 / ticks_of_frame as f32;
            let limit = Options::cold().unsigned();
            let is_known = rng.bool();
            let known = |stretch| if is_known { limit.stretch(stretch) } else { limit };
            match rng.u32(..4) {
                0 => subject.tick(&step.after(), &tool, &known(measured), budget),
                1 if measure_stretch(&tree, &step.beyond(share)).is_ok() => {
                    let measured = measure_stretch(&tree, &step.beyond(share)).expect("within");
                    subject.tick(&step.beyond(share), &tool, &known(measured), budget);
                }
                _ => subject.tick(&step.at(share), &tool, &known(both), budget),
            }
            if rng.u32(..2_000) == 0 {
                subject.tracker.forget();
            }
        }
        (before, stretch) = (after, measured);
    }
    subject.tally
}

#[test]
fn answers_as_whole_queries_do_on_random_walks() {
    let meshes = [
        generate::heart(1_280).expect("a valid size").mesh,
        generate::brain(1_200).expect("a valid size"),
        surfaces::ball(3),
        surfaces::slivers(60),
    ];
    for (mesh, seed) in meshes.iter().zip(1..) {
        let tally = wander::<256>(mesh, ticks(16_000) / 4, seed);
        println!("{} triangles: {tally:?}", mesh.triangles.len());
        let [_, surface, jumps, _, none] = tally.fallbacks;
        assert!(tally.cut_short > 0 && surface > 0 && jumps > 0, "{tally:?}");
        assert!(none > tally.ticks / 2, "{tally:?}");
    }
}

#[test]
fn a_full_front_falls_back_on_whole_queries() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let tally = wander::<6>(&mesh, ticks(8_000) / 4, 5);
    println!("{tally:?}");
    let [_, _, _, full, none] = tally.fallbacks;
    assert!(full > 0 && none > 0, "{tally:?}");
}

#[test]
fn odometers_wrap() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut subject = Subject::<64>::new(&tree);
    let mut odometer = Odometer::new(&tree);
    let rows = built.to_rows(&mesh.positions);
    let surface = odometer.start(rows.as_slice());
    let mut rng = Rng::with_seed(6);
    let middle = rows.iter().sum::<Vec3>() / rows.len() as f32;
    let size = rows.iter().map(|p| p.distance(middle)).fold(0.0, f32::max);
    // The tool moves back and forth, so far in total that the odometer wraps within the test.
    let mut tip = middle + Vec3::X * size * 1.2;
    for tick in 0..40_000 {
        let step = Vec3::X * size / 70.0;
        tip += (if tick % 2 == 0 { step } else { -step }) + unit(&mut rng) * size * 1e-4;
        let tool = Instrument::capsule(tip, tip + Vec3::ONE * size, 1.0);
        // For a long time no node is tested, so that bounds get as old as possible.
        let is_starved = tick / 8_000 % 3 == 1;
        let budget = is_starved.then_some(Budget::new(8));
        subject.tick(&surface, &tool, &Options::cold().unsigned(), budget);
    }
    println!("{:?}", subject.tally);
    let [_, _, jumps, _, none] = subject.tally.fallbacks;
    assert!(jumps > 0 && none > 20_000, "{:?}", subject.tally);
}

#[test]
fn a_tick_on_the_path_of_table_3_takes_few_tests() {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = built.tree::<u16>().expect("valid");
    let beat = Beat::new(&motion);
    let mut subject = Subject::<256>::new(&tree);
    let mut odometer = Odometer::new(&tree);
    let (mut positions, mut before) = (Vec::new(), built.to_rows(&motion.frames[0]));
    for tick in 0..ticks(4_000) as u32 / 2 {
        beat.deform(tick, &mut positions);
        let rows = built.to_rows(&positions);
        let Probe::Capsule(tool) = beat.tool(tick) else { unreachable!("the beat's is a capsule") };
        let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
        let surface = odometer.step(before.as_slice(), rows.as_slice()).after();
        subject.ask(&surface, &tool, &Options::cold().unsigned().stretch(measured), None);
        before = rows;
    }
    let tally = &subject.tally;
    println!("{tally:?}");
    assert_eq!(tally.fallbacks[4], tally.ticks - 1, "{tally:?}");
    assert!(tally.nodes[0] * 12 < tally.nodes[1], "{tally:?}");
}

/// A front that was full starts again: it is full again only if a newly started one is.
#[test]
fn a_full_front_does_not_stay_full() {
    type Small<'t> = Tracker<'t, u16, MAX_STACK, 100>;
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("builds");
    let tree = built.tree::<u16>().expect("valid");
    let beat = Beat::new(&motion);
    let mut tracker = Small::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let (mut positions, mut before) = (Vec::new(), built.to_rows(&motion.frames[0]));
    let (mut last, mut full, mut full_again, mut stuck) = (None, 0, 0, 0);
    for tick in 0..ticks(14_000) as u32 / 2 {
        beat.deform(tick, &mut positions);
        let rows = built.to_rows(&positions);
        let Probe::Capsule(tool) = beat.tool(tick) else { unreachable!("the beat's is a capsule") };
        let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
        let surface = odometer.step(before.as_slice(), rows.as_slice()).after();
        let options = Options::new().unsigned().stretch(measured);
        let found = tracker.closest(&surface, &tool, &options).expect("an answer");
        let (was, first) = last.unwrap_or((None, None));
        if found.fallback == Some(Fallback::Full) {
            full += 1;
            if was == Some(Fallback::Full) {
                full_again += 1;
                let mut fresh = Small::new(&tree).expect("deep enough");
                let fresh = fresh.closest(&surface, &tool, &options.warm_start(first));
                stuck += usize::from(fresh.expect("an answer").fallback != Some(Fallback::Full));
            }
        } else if was == Some(Fallback::Full) {
            assert_eq!(found.fallback, Some(Fallback::Start), "tick {tick}");
        }
        last = Some((found.fallback, found.closest.triangle));
        before = rows;
    }
    println!("{full} full, {full_again} again, {stuck} stuck");
    assert!(full_again > 0 && stuck == 0);
}

/// A tick may skip a triangle that is closer than its pair by less than a query's accuracy.
#[test]
fn a_tick_states_twice_the_accuracy_of_a_query() {
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut tracker = Tracker::<u16, MAX_STACK, 512>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let (mut at, mut rng) = (Vec3::X * 60.0, Rng::with_seed(6));
    for _ in 0..200 {
        at += unit(&mut rng);
        let tool = Capsule::new(at, at + Vec3::Y * 20.0, 1.0).expect("valid");
        let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
        let found = tracker.closest(&surface, &tool, &Options::new()).expect("an answer");
        let stated = found.closest.accuracy / whole.accuracy;
        assert!((1.999..2.001).contains(&stated), "{stated}: {found:?} {whole:?}");
    }
}

/// A place of the front that was freed counts as due once tool and surface have moved far enough in all. It stays free.
#[test]
fn a_place_that_is_free_outlasts_any_motion() {
    const STEP: f32 = 0.45;
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut tracker = Tracker::<u16, MAX_STACK, 128>::new(&tree).expect("deep enough");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let top = rows.iter().copied().max_by(|a, b| a.z.total_cmp(&b.z)).expect("rows");
    for tick in 0..24_000_u16 {
        // Down to the surface, where nodes are opened, up and away to the side, where they are closed; then to and fro.
        let (up, away) = match tick {
            0..200 => (tick.abs_diff(100), 0),
            200..600 => (100, tick - 200),
            _ => (100, 400 + tick % 2),
        };
        let way = Vec3::Z * f32::from(up) + Vec3::new(0.6, 0.0, -0.8) * f32::from(away);
        let tool = Sphere::new(top + way * STEP, 1.0).expect("a valid sphere");
        let options = Options::new().unsigned();
        let found = tracker.closest(&surface, &tool, &options).expect("an answer");
        assert_eq!(found.fallback.is_some(), tick == 0, "{tick}: {found:?}");
        if tick % 50 == 0 {
            let whole = query.closest(&surface, &tool, &options).expect("an answer");
            let accuracy = found.closest.accuracy + whole.accuracy;
            let off = (found.closest.separation - whole.separation).abs();
            assert!(off <= accuracy, "{tick}: {found:?} {whole:?}");
        }
    }
}

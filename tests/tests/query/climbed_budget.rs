//! Climbs towards a false interval of a tracker, and a wall let go, over the tool's motion and each tick's budget. Truth
//! in f64.

// Requirement: T-02

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Odometer, Options, Side, Tracker, VertexTable};
use dibs_tests::climb::climb;
use dibs_tests::deform::unit;
use dibs_tests::oracle::Instrument;
use dibs_tests::sample;
use dibs_tests::sides::bounded_separation;
use dibs_tests::surfaces::{self, ball};
use fastrand::Rng;
use glam::Vec3;
use rayon::prelude::*;

const RADIUS: f32 = 1.0;

/// An interval that is narrower (mm) says nothing of the last tick's.
const WIDE: f64 = 0.1;

/// A closed surface on its way from each frame to the next.
struct Scene {
    built: BuiltTree,
    frames: Vec<Vec<Vec3>>,
}

impl Scene {
    fn new(mesh: &Mesh, frames: &[Vec<Vec3>]) -> Self {
        let built = Builder::new().stretch(1.5).build(mesh).expect("a valid mesh");
        let frames = frames.iter().map(|frame| built.to_rows(frame)).collect();
        Self { built, frames }
    }
}

/// The change of a tick.
#[derive(Clone, Copy, Debug)]
struct Tick {
    /// Motion (mm) of the tool's ends.
    steps: [Vec3; 2],
    /// The fraction of the way between two frames that the surface moves.
    share: f32,
    /// Node tests.
    budget: u32,
}

/// A tracker's ticks.
#[derive(Clone)]
struct Run {
    frame: usize,
    tool: [Vec3; 2],
    /// Node tests of the first tick.
    first: u32,
    ticks: [Tick; 4],
}

fn any_budget(rng: &mut Rng) -> u32 {
    (300.0 * rng.f32().powi(3)) as u32
}

impl Run {
    fn any(scene: &Scene, rng: &mut Rng) -> Self {
        let frame = rng.usize(..scene.frames.len() - 1);
        let tip = scene.frames[frame][rng.usize(..scene.frames[frame].len())];
        let tip = tip + unit(rng) * 15.0 * rng.f32();
        let end = tip + unit(rng) * rng.choice([0.0, 4.0, 30.0]).expect("three");
        let first = if rng.bool() { any_budget(rng) } else { u32::MAX };
        let ticks = [(); 4].map(|()| {
            let step = unit(rng) * 2.0 * rng.f32();
            let steps = [step, step + unit(rng) * 0.5 * rng.f32()];
            Tick { steps, share: 0.2 * rng.f32(), budget: any_budget(rng) }
        });
        Self { frame, tool: [tip, end], first, ticks }
    }

    fn changed(&self, rng: &mut Rng) -> Self {
        let mut next = self.clone();
        let tick = &mut next.ticks[rng.usize(..4)];
        let far = rng.f32().powi(3);
        match rng.u32(..8) {
            0 => next.tool = next.tool.map(|end| end + unit(rng) * far),
            1 => next.first = any_budget(rng),
            2 => tick.budget = any_budget(rng),
            3 => tick.budget = tick.budget.saturating_add_signed(rng.i32(-8..=8)),
            4 => tick.share = 0.24 * rng.f32(),
            5 => tick.steps = tick.steps.map(|step| step + unit(rng) * far),
            6 => {
                let by = unit(rng) * far;
                tick.steps = tick.steps.map(|step| step + by);
            }
            _ => tick.steps[rng.usize(..2)] += unit(rng) * far,
        }
        next
    }

    /// By how much (mm) the truth is outside of a certified interval, in the worst tick; and the same of ticks with a wide
    /// interval, as a fraction of its width. Both are negative inside. No tick loses a side once one had it.
    fn outside(&self, scene: &Scene) -> Option<[f64; 2]> {
        let tree = scene.built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let mut tracker = Tracker::<u16, MAX_STACK, 128>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let [from, to] = [self.frame, self.frame + 1].map(|frame| scene.frames[frame].as_slice());
        let step = odometer.step(from, to);
        let rest = Tick { steps: [Vec3::ZERO; 2], share: 0.0, budget: self.first };
        let (mut tool, mut share, mut had_side) = (self.tool, 0.0, false);
        let mut worst: Option<[f64; 2]> = None;
        for tick in [&[rest], self.ticks.as_slice()].concat() {
            share += tick.share;
            for (end, by) in tool.iter_mut().zip(tick.steps) {
                *end += by;
            }
            let surface = step.at(share);
            let options = Options::new().budget(Budget::new(tick.budget));
            let capsule = Capsule::new(tool[0], tool[1], RADIUS).expect("finite");
            let found = tracker.closest(&surface, &capsule, &options).expect("an answer").closest;
            let has_side = !matches!(found.side, Side::Undefined(_));
            assert!(has_side || !had_side, "{:?}: {found:?}", self.ticks);
            had_side |= has_side;
            let known = found.interval();
            let rows = (0..surface.len() as u32).map(|row| surface.position(row).expect("a row"));
            let rows: Vec<Vec3> = rows.collect();
            // The query's own ends.
            let tool = Instrument::capsule(capsule.start(), capsule.end(), RADIUS);
            let (low, high) = bounded_separation(&rows, &triangles, &tool, 0.01)?;
            let beyond = (f64::from(known.lower) - high).max(low - f64::from(known.upper));
            let width = f64::from(known.upper) - f64::from(known.lower);
            let relative = if (WIDE..1e3).contains(&width) { beyond / width } else { -1.0 };
            let [most, near] = worst.unwrap_or([f64::NEG_INFINITY; 2]);
            worst = Some([most.max(beyond), near.max(relative)]);
        }
        worst
    }
}

#[test]
fn no_climb_over_motion_and_budgets_leaves_an_interval() {
    let generate::MovingMesh { mesh, motion } = generate::heart(320).expect("a valid size");
    let still = ball(2);
    let scenes = [
        Scene::new(&mesh, &motion.frames),
        Scene::new(&still, &[still.positions.clone(), still.positions.clone()]),
    ];
    let climbs = (0..sample(200) as u64).into_par_iter().map(|seed| {
        let scene = &scenes[seed as usize % scenes.len()];
        let mut rng = Rng::with_seed(seed);
        let start = Run::any(scene, &mut rng);
        let (mut most, mut judged) = (f64::NEG_INFINITY, 0_u64);
        let score = |run: &Run| {
            let [beyond, relative] = run.outside(scene)?;
            judged += 1;
            most = most.max(beyond);
            Some(if beyond > 0.0 { 1.0 + beyond } else { relative })
        };
        let (_, nearest) = climb(start, 150, |run| run.changed(&mut rng), score);
        (most, nearest, judged)
    });
    let climbs: Vec<(f64, f64, u64)> = climbs.collect();
    let most = climbs.iter().fold(f64::NEG_INFINITY, |most, climb| most.max(climb.0));
    let near = climbs.iter().filter(|climb| climb.1 > -0.01).count();
    let judged: u64 = climbs.iter().map(|climb| climb.2).sum();
    println!("{judged} runs, {near} of {} climbs reach an end, {most} mm outside", climbs.len());
    assert!(most <= 0.0, "{climbs:?}");
    assert!(near * 4 > climbs.len(), "{climbs:?}");
}

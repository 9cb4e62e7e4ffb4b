//! A tracker's ticks within a budget: an instrument that hovers over a beating heart, touches it, passes through its
//! wall, lies along it and moves fast. Each tick's answer is compared with whole queries.

// Requirement: T-02

use anyhow::Result;
use dibs_build::{Builder, BuiltTree, Motion, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, MeasuredStretch, Odometer, Options, Proximity, Query, Side, Sphere, Tool,
    Tracker, Tree, measure_stretch,
};
use glam::Vec3;
use probe::track::tick;
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, note};
use crate::harness::{Check, Effort};
use crate::probe::ticks::{Script, read};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

/// The budgets in tests, and the suffixes of their figures' names: the most instructions of a tick on the board.
const BUDGETS: [(u32, &str); 4] = [(36, "20k"), (170, "40k"), (290, "60k"), (500, "100k")];

/// Ticks for each frame of the heart's motion: 25 frames a second.
const TICKS_A_FRAME: usize = 40;

/// Ticks that a cold start may take.
const SETTLED: usize = 100;

/// A motion (mm) in one tick from which on the next tick counts as a cold start.
const LEAP: f32 = 1.5;

/// Separation (mm) at which a wall begins.
const MARGIN: f32 = 5.0;

/// The instrument's radius and length (mm).
const RADIUS: f32 = 2.5;
const LENGTH: f32 = 120.0;

/// A point inside the generated heart.
const MIDDLE: Vec3 = Vec3::new(12.0, -4.0, 38.0);

/// The instrument's motion, each for a fifth of the path.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Hovers,
    Touches,
    Passes,
    LiesAlong,
    Hurries,
}

const PHASES: [Phase; 5] =
    [Phase::Hovers, Phase::Touches, Phase::Passes, Phase::LiesAlong, Phase::Hurries];

/// A tree, its surface's frames with their stretches, and the poses of a path.
struct Scene {
    tree: BuiltTree,
    frames: Vec<(Vec<Vec3>, MeasuredStretch)>,
    path: Vec<Capsule>,
}

/// The result of whole queries for a tick.
struct Truth {
    lower: f32,
    upper: f32,
    accuracy: f32,
    direction: Vec3,
}

impl Scene {
    fn new(ticks: usize) -> Result<Self> {
        let generate::MovingMesh { mesh, motion: Motion { frames, .. } } = generate::heart(10_272)?;
        let tree = Builder::new().stretch(1.5).build(&mesh)?;
        let view = tree.tree::<u16>()?;
        let corners: Vec<[Vec3; 3]> =
            mesh.triangles.iter().map(|rows| rows.map(|row| frames[0][row as usize])).collect();
        let path = path(&corners, ticks);
        let frames = frames.iter().map(|frame| {
            let rows = tree.to_rows(frame);
            let stretch = measure_stretch(&view, rows.as_slice())?;
            Ok((rows, stretch))
        });
        let frames = frames.collect::<Result<_>>()?;
        Ok(Self { tree, frames, path })
    }

    /// Calls a function with each tick's surface and pose.
    fn each<T>(
        &self,
        tree: &Tree<'_, u16>,
        mut ask: impl FnMut(
            usize,
            &dibs_nostd::SurfaceBlend<'_, [Vec3], [Vec3]>,
            &Capsule,
            Options,
        ) -> T,
    ) -> Vec<T> {
        let mut odometer = Odometer::new(tree);
        let mut step = None;
        let ticks = self.path.iter().enumerate().map(|(tick, tool)| {
            let (frame, share) = place(tick);
            let (rows, stretch) = &self.frames[frame % self.frames.len()];
            let (next, next_stretch) = &self.frames[(frame + 1) % self.frames.len()];
            if share == 0.0 {
                step = Some(odometer.step(rows.as_slice(), next.as_slice()));
            }
            let surface = step.as_ref().expect("a step").at(share);
            let both = stretch.or_larger(*next_stretch).expect("one tree");
            ask(tick, &surface, tool, Options::new().stretch(both))
        });
        ticks.collect()
    }
}

/// A tick's frame, and the fraction of the interval to the next frame.
fn place(tick: usize) -> (usize, f32) {
    (tick / TICKS_A_FRAME, (tick % TICKS_A_FRAME) as f32 / TICKS_A_FRAME as f32)
}

/// The poses of a path with this many ticks.
fn path(corners: &[[Vec3; 3]], ticks: usize) -> Vec<Capsule> {
    let (mut looked, mut wall) = (Vec3::ZERO, 0.0);
    let poses = (0..ticks).map(|tick| {
        let time = tick as f32 * 0.001;
        let phase = PHASES[(tick * PHASES.len() / ticks).min(PHASES.len() - 1)];
        let speed = if phase == Phase::Hurries { 2.0 } else { 0.5 };
        let (around, up) = (speed * time, 0.7 + 0.4 * (0.37 * speed * time).sin());
        let out = Vec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin());
        if out.distance(looked) > 0.003 {
            (looked, wall) = (out, farthest(corners, MIDDLE, out));
        }
        let height = match phase {
            Phase::Hovers => 5.5 + 3.0 * (2.1 * time).sin(),
            Phase::Touches => 1.5 + 3.0 * (3.1 * time).sin(),
            Phase::Passes => -12.0 + 18.0 * (1.3 * time).sin(),
            Phase::LiesAlong => 2.0 + 2.0 * time.sin(),
            Phase::Hurries => -5.0 + 15.0 * (5.3 * time).sin(),
        };
        let tip = MIDDLE + out * (wall + height + RADIUS);
        let pivot = match phase {
            Phase::LiesAlong => tip + out.any_orthonormal_vector() * 100.0 + out * 12.0,
            _ => MIDDLE + Vec3::new(20.0, 10.0, 220.0),
        };
        let end = tip + (pivot - tip).normalize() * LENGTH;
        Capsule::new(tip, end, RADIUS).expect("finite")
    });
    poses.collect()
}

/// The farthest intersection of a ray with a surface: its distance from the ray's start.
fn farthest(corners: &[[Vec3; 3]], from: Vec3, along: Vec3) -> f32 {
    let crossings = corners.iter().filter_map(|&[a, b, c]| {
        // Möller and Trumbore (1997).
        let (ab, ac) = (b - a, c - a);
        let across = along.cross(ac);
        let volume = ab.dot(across);
        let away = from - a;
        let u = away.dot(across) / volume;
        let v = along.dot(away.cross(ab)) / volume;
        let far = ac.dot(away.cross(ab)) / volume;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(far)
    });
    crossings.fold(0.0, f32::max)
}

/// Results of the ticks with one budget.
#[derive(Default)]
struct Tally {
    wrong: usize,
    damped: usize,
    turned: usize,
    /// Widths of the intervals near the wall.
    widths: Vec<f32>,
}

/// Runs a tracker over the path within a budget.
fn run(scene: &Scene, truth: &[Truth], budget: Budget) -> Tally {
    let tree = scene.tree.tree::<u16>().expect("16-bit indices");
    let mut tracker = Tracker::<_, MAX_STACK, 512>::new(&tree).expect("enough for any tree");
    let mut point = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let wall = ForbiddenRegion::new(spring, MARGIN).expect("a valid margin");
    let (mut tally, mut since) = (Tally::default(), 0);
    scene.each(&tree, |tick, surface, tool, options| {
        let options = options.budget(budget);
        let tracked = tracker.closest(surface, tool, &options).expect("an answer");
        let is_leap = tracked.moved.is_none_or(|moved| moved > LEAP);
        since = if is_leap { 0 } else { since + 1 };
        let (found, truth) = (tracked.closest, &truth[tick]);
        let accuracy = found.accuracy + truth.accuracy;
        let is_open = matches!(found.side, Side::Undefined(_));
        let is_outside = found.lower - accuracy > truth.upper
            || found.separation + accuracy < truth.lower && !is_open;
        tally.wrong += usize::from(is_outside);
        if truth.lower >= MARGIN || since < SETTLED {
            return;
        }
        tally.widths.push(found.separation - found.lower);
        let force = wall.force(&Ok(found), Vec3::ZERO);
        let is_damped = matches!(force.state, ConstraintState::Safe(_));
        tally.damped += usize::from(is_damped);
        let is_turned = found.direction.dot(truth.direction) < std::f32::consts::FRAC_1_SQRT_2;
        tally.turned +=
            usize::from(is_turned && !is_deepest(&mut point, surface, tool, &found, truth));
    });
    tally.widths.sort_by(f32::total_cmp);
    tally
}

/// Whether an answer's pair is the deepest or the closest one, within half a millimetre.
fn is_deepest(
    point: &mut Query<'_, u16, MAX_STACK>,
    surface: &dibs_nostd::SurfaceBlend<'_, [Vec3], [Vec3]>,
    tool: &Capsule,
    found: &Proximity,
    truth: &Truth,
) -> bool {
    let at = tool.axis_point(found.axis_parameter);
    let sphere = Sphere::new(at, 0.0).expect("finite");
    let own = point.closest(surface, &sphere, &Options::new()).expect("an answer");
    own.separation <= truth.upper + RADIUS + 0.5
        && found.point_on_surface.distance(at) <= own.separation.abs() + 0.5
}

fn truth(scene: &Scene) -> Vec<Truth> {
    let tree = scene.tree.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    scene.each(&tree, |_, surface, tool, options| {
        let options = options.depth_tolerance(0.02);
        let found = query.closest(surface, tool, &options).expect("an answer");
        let Proximity { lower, separation: upper, accuracy, direction, .. } = found;
        Truth { lower, upper, accuracy, direction }
    })
}

pub const CHECK: Check = Check {
    name: "ticks within a budget",
    run: check,
    promises: &[
        Promise {
            id: "bounded.wrong",
            says: "A tracker's certified interval holds the true separation at every tick, whatever the budget",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {bounded.ticks} ticks with each of four budgets",
            limits: "A beating heart, an instrument that hovers, touches, passes the wall, lies along it and hurries. Truth by whole \
                     queries.",
        },
        note("bounded.ticks"),
        Promise {
            id: "bounded.damped",
            says: "Once it has settled, no tick near the wall leaves the constraint without a spring",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {bounded.near} ticks within 5 mm, with four budgets",
            limits: "After 100 ticks, and after 100 from each leap.",
        },
        note("bounded.near"),
        width(
            "bounded.20k.95",
            "With a budget of 20,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
            "mm; 99 %: {bounded.20k.99}, largest {bounded.20k.largest}; pair off the deepest and turned: {bounded.20k.turned} %",
            Bound::Informs,
        ),
        note("bounded.20k.99"),
        note("bounded.20k.largest"),
        note("bounded.20k.turned"),
        largest(
            "bounded.20k.instructions",
            "On the board the largest of these ticks takes",
            "instructions; the mean one {bounded.20k.mean}",
            20_000.0,
        ),
        note("bounded.20k.mean"),
        width(
            "bounded.40k.95",
            "With a budget of 40,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
            "mm; 99 %: {bounded.40k.99}, largest {bounded.40k.largest}; pair off the deepest and turned: {bounded.40k.turned} %",
            Bound::Informs,
        ),
        note("bounded.40k.99"),
        note("bounded.40k.largest"),
        note("bounded.40k.turned"),
        largest(
            "bounded.40k.instructions",
            "On the board the largest of these ticks takes",
            "instructions; the mean one {bounded.40k.mean}",
            40_000.0,
        ),
        note("bounded.40k.mean"),
        width(
            "bounded.60k.95",
            "With a budget of 60,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
            "mm; 99 %: {bounded.60k.99}, largest {bounded.60k.largest}; pair off the deepest and turned: {bounded.60k.turned} %",
            Bound::AtMost(1.0),
        ),
        note("bounded.60k.99"),
        note("bounded.60k.largest"),
        note("bounded.60k.turned"),
        largest(
            "bounded.60k.instructions",
            "On the board the largest of these ticks takes",
            "instructions; the mean one {bounded.60k.mean}",
            60_000.0,
        ),
        note("bounded.60k.mean"),
        width(
            "bounded.100k.95",
            "With a budget of 100,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
            "mm; 99 %: {bounded.100k.99}, largest {bounded.100k.largest}; pair off the deepest and turned: {bounded.100k.turned} %",
            Bound::AtMost(0.35),
        ),
        note("bounded.100k.99"),
        note("bounded.100k.largest"),
        note("bounded.100k.turned"),
        largest(
            "bounded.100k.instructions",
            "On the board the largest of these ticks takes",
            "instructions; the mean one {bounded.100k.mean}",
            100_000.0,
        ),
        note("bounded.100k.mean"),
    ],
};

/// The width of the interval within a budget.
const fn width(id: &'static str, says: &'static str, unit: &'static str, bound: Bound) -> Promise {
    Promise { id, says, criterion: TIMING, bound, unit, limits: "" }
}

/// The sorted instructions of all ticks except the first, of a tracker on the board within a budget.
fn on_board(scene: &Scene, budget: Budget) -> Result<Vec<u32>> {
    let program = build_for_board(&board()?, "chain")?;
    let frames = &scene.frames;
    let mut script = Script::new(&scene.tree, &frames[0].0);
    let bits = tick::INTERPOLATED | tick::SIGNED | budget.tests() << tick::BUDGET;
    for (at, tool) in scene.path.iter().enumerate() {
        let (frame, share) = place(at);
        if share == 0.0 {
            script.frame(&frames[(frame + 1) % frames.len()].0);
        }
        script.tick(bits, share, tool);
    }
    let ticks = scene.path.len() as u32;
    let ticks = read(&run_on_board(&program, &script.end(), COUNTING)?, ticks)?;
    let mut taken: Vec<u32> = ticks.iter().map(|tick| tick.instructions).collect();
    taken.sort_unstable();
    Ok(taken)
}

/// The largest tick within the budget.
const fn largest(id: &'static str, says: &'static str, unit: &'static str, most: f64) -> Promise {
    let limits =
        "The same path, the surface interpolated. Emulated Cortex-M7; instructions, not cycles.";
    Promise { id, says, criterion: TIMING, bound: Bound::AtMost(most), unit, limits }
}

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let scene = Scene::new(effort.bounded_ticks)?;
    let truth = truth(&scene);
    let budgets = BUDGETS.map(|(tests, _)| Budget::new(tests));
    let tallies: Vec<Tally> =
        budgets.par_iter().map(|&budget| run(&scene, &truth, budget)).collect();
    let sum = |of: fn(&Tally) -> usize| tallies.iter().map(of).sum::<usize>() as f64;
    figures.note("bounded.ticks", scene.path.len() as f64);
    figures.note("bounded.wrong", sum(|tally| tally.wrong));
    figures.note("bounded.damped", sum(|tally| tally.damped));
    figures.note("bounded.near", sum(|tally| tally.widths.len()));
    for ((tally, (_, name)), budget) in tallies.iter().zip(BUDGETS).zip(budgets) {
        let last = tally.widths.len().saturating_sub(1) as f64;
        for (end, part) in [("95", 0.95), ("99", 0.99), ("largest", 1.0)] {
            let width = tally.widths.get((last * part) as usize).copied().unwrap_or_default();
            let width = (f64::from(width) * 100.0).round() / 100.0;
            figures.note(&format!("bounded.{name}.{end}"), width);
        }
        let taken = on_board(&scene, budget)?;
        let mean = taken.iter().map(|&taken| f64::from(taken)).sum::<f64>() / taken.len() as f64;
        figures.note(&format!("bounded.{name}.mean"), mean.round());
        figures.note(
            &format!("bounded.{name}.instructions"),
            taken.last().copied().unwrap_or_default().into(),
        );
        let turned = tally.turned as f64 / tally.widths.len().max(1) as f64 * 100.0;
        figures.note(&format!("bounded.{name}.turned"), (turned * 100.0).round() / 100.0);
    }
    Ok(Outcome::Passed)
}

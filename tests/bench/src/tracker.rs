//! A tracker's ticks on the emulated Cortex-M7, on generated and real surfaces: table 6.

use std::fmt::Write;

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, BuiltTree, IndexWidth, Motion, MotionStretch, Paths};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Options, Query, Side, Sphere};
use dibs_tests::streams::{Pulse, TICK_RATE};
use fastrand::Rng;
use glam::Vec3;
use probe::track::{OPENED, tick};

use super::brain::STRETCH;
use super::facts;
use super::names::DIBS;
use super::plan::{self, Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::Summary;
use super::subjects::{self, Heart};
use dibs_prove::probe::ticks::{Tick, read, script};
use dibs_prove::probe::{COUNTING, board, build_for_board, run_on_board};

pub const EXPERIMENT: &str = "tracker";
/// The facts about its run.
pub const RUN: &str = "tracker-run";

/// Frames a second of the pulsing brain, and the seed of its motion.
const RATE: f32 = 30.0;
const SEED: u64 = 3_000;
/// Margin of learned limits.
const MARGIN: f32 = 0.1;

/// The questions: a name, the bits for the probe, and its program.
const QUESTIONS: [(&str, u32, &str); 4] = [
    ("closest pair", tick::INTERPOLATED, "track"),
    ("and side", tick::INTERPOLATED | tick::SIDE, "side"),
    ("and side, held", tick::SIDE, "side"),
    ("and depth", tick::INTERPOLATED | tick::SIGNED, "chain"),
];

/// Runs this experiment anew, whatever the records have of it.
pub fn run(plan: &Plan, options: &plan::Options, records: &mut Records) -> Result<()> {
    records.0.retain(|r| ![EXPERIMENT, RUN].contains(&r.experiment.as_str()));
    facts::of(RUN, plan, options, records);
    let follow = |name: &str, built: &BuiltTree, motion: &Motion, records: &mut Records| {
        let cuts_itself = cuts_itself(built, &motion.frames[0])?;
        let progress = Progress::start(&format!("a tracker on the board, {name}"), 0);
        for (question, bits, program) in QUESTIONS {
            let program = build_for_board(&board()?, program)?;
            let cell = Cell::new(EXPERIMENT, name, built.summary().triangles as usize, question);
            let words =
                run_on_board(&program, &script(built, motion, bits, plan.board_ticks)?, COUNTING)?;
            let ticks = read(&words, plan.board_ticks)?;
            let other = ticks.iter().position(|tick| !tick.is_whole());
            ensure!(
                other.is_none() || cuts_itself && bits & tick::SIGNED != 0,
                "{name}, {question}: tick {other:?} is not a whole query's answer"
            );
            note(&cell, &ticks, records);
        }
        progress.finish();
        anyhow::Ok(())
    };
    for heart in subjects::hearts(plan.heart_triangles)? {
        follow(&heart.name, &of_heart(&heart)?, &heart.motion, records)?;
    }
    let subject = subjects::brain(plan.board_brain)?;
    let built = builder().stretch(STRETCH).build(&subject.mesh)?;
    let pulse = Pulse::new(&subject.mesh.positions, SEED);
    let count = (plan.board_ticks as f32 / TICK_RATE * RATE) as u32 + 2;
    let frames = (0..count).map(|number| {
        let mut positions = Vec::new();
        pulse.deform(number as f32 / RATE, &mut positions);
        positions
    });
    let motion = Motion { frames: frames.collect(), rate: RATE, ..Motion::default() };
    follow(&subject.name, &built, &motion, records)
}

/// Whether the surface is shown to cut itself: somewhere along a line the depth below it, outside negative, changes by
/// more than the way.
fn cuts_itself(built: &BuiltTree, positions: &[Vec3]) -> Result<bool> {
    const LINES: u32 = 100;
    const POINTS: u32 = 2_000;
    let tree = built.tree::<u16>()?;
    let rows = built.to_rows(positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree)?;
    let mut rng = Rng::with_seed(SEED);
    for _ in 0..LINES {
        let [from, to] = [(); 2].map(|()| rows[rng.usize(..rows.len())]);
        let mut last = None::<(Vec3, f32)>;
        for number in 0..=POINTS {
            let point = from.lerp(to, number as f32 / POINTS as f32);
            let found =
                query.closest(rows.as_slice(), &Sphere::new(point, 0.0)?, &Options::new())?;
            let depth = match found.side {
                Side::Inside => found.axis_distance,
                Side::Outside => -found.axis_distance,
                _ => continue,
            };
            let error = 2.0 * found.accuracy;
            if last.is_some_and(|(at, was)| (depth - was).abs() > point.distance(at) + error) {
                return Ok(true);
            }
            last = Some((point, depth));
        }
    }
    Ok(false)
}

fn builder() -> Builder<'static> {
    Builder::new().index(IndexWidth::Bits16)
}

/// Limits as table 3's, or learned from the motion.
fn of_heart(heart: &Heart) -> Result<BuiltTree> {
    let builder = match heart.stretch {
        Some(limit) => builder().stretch(limit),
        None => {
            let needed = MotionStretch::new(&heart.mesh, &heart.motion, Paths::default(), &|_| ())
                .context("measuring the motion")?;
            builder().limits(needed.limits(MARGIN))
        }
    };
    Ok(builder.build(&heart.mesh)?)
}

fn note(cell: &Cell, ticks: &[Tick], records: &mut Records) {
    let mut put = |metric: &str, unit: &str, of: &dyn Fn(&Tick) -> f64| {
        let values: Vec<f64> = ticks.iter().map(of).collect();
        records.push(Record::summary(cell, DIBS, metric, &Summary::of(&values), unit));
    };
    put("tracked", "instructions", &|tick| f64::from(tick.instructions));
    put("whole", "instructions", &|tick| f64::from(tick.whole));
    put("node_tests", "tests", &|tick| f64::from(tick.tests[0]));
    put("triangle_tests", "tests", &|tick| f64::from(tick.tests[1]));
    put("others", "share of ticks", &|tick| f64::from(u8::from(!tick.is_whole())));
    put("fallbacks", "share of ticks", &|tick| f64::from(u8::from(tick.is_fallback)));
}

/// Table 6.
pub fn table(page: &mut String, records: &Records) {
    let meshes = records.meshes(EXPERIMENT);
    if meshes.is_empty() {
        return;
    }
    let fact = |metric| records.note_of(RUN, metric);
    let _ = writeln!(
        page,
        "\n## Table 6: a tracker's tick on the emulated Cortex-M7\n\n\
         Instructions of `Tracker::closest`, not cycles: a capsule on table 3's path, ticks of 1 ms in a row, the first \
         aside, the surface interpolated and thus another at every tick, or held until the next frame. *And side* takes \
         any depth where the axis crosses (`Options::depth_tolerance` without end), *and depth* a depth to the default \
         tolerance. The tracker remembers {OPENED} opened nodes; a tick that falls back is a whole query. *Whole* is a \
         whole query on the board, warm. The answer of every tick is a whole query's; otherwise nothing is recorded, \
         but for the depth in a surface that is shown to cut itself, as this brain: where sheets have passed through \
         each other the depth jumps from point to point, and no bound on it holds. Such ticks are *others*. \
         The human heart has the limits that its motion needs and a tenth more, the generated one 1.5, the brain 2: it \
         pulses in long waves, 30 frames a second.\n\n\
         Recorded by `{}` on {}, commit {}, {}.\n\n\
         | surface | triangles | answer | ticks | mean | p99 | largest | whole | node tests | triangle tests | fall-backs \
         | others |\n|---|---|---|---|---|---|---|---|---|---|---|---|",
        fact("command"),
        fact("machine"),
        fact("commit"),
        fact("date")
    );
    for (mesh, triangles) in meshes {
        for (question, ..) in QUESTIONS {
            let cell = Cell::new(EXPERIMENT, &mesh, triangles as usize, question);
            let get = |metric| records.find(&cell, DIBS, metric);
            let (Some(took), Some(whole), Some(nodes), Some(tests), Some(fallbacks), Some(others)) = (
                get("tracked"),
                get("whole"),
                get("node_tests"),
                get("triangle_tests"),
                get("fallbacks"),
                get("others"),
            ) else {
                continue;
            };
            let _ = writeln!(
                page,
                "| {mesh} | {triangles} | {question} | {} | {:.0} | {:.0} | {:.0} | {:.0} | {:.1} | {:.1} | {:.0} | {:.0} |",
                took.n,
                took.mean,
                took.p99,
                took.max,
                whole.mean,
                nodes.mean,
                tests.mean,
                fallbacks.mean * fallbacks.n as f64,
                others.mean * others.n as f64
            );
        }
    }
}

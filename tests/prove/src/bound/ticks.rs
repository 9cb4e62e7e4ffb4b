//! The ticks of a tracker that have a bound, and measurements on the emulated board.

// Requirement: A-06

use std::path::Path;

use anyhow::{Result, ensure};
use dibs_build::{Builder, IndexWidth, Mesh, Motion, generate};
use dibs_nostd::Capsule;
use dibs_tests::deform::unit;
use dibs_tests::motions::trembling;
use dibs_tests::surfaces::ball;
use fastrand::Rng;
use glam::Vec3;
use probe::track::{ANSWER_WORDS, tick};

use super::depth::{TRACKED_DEPTH, TRACKED_DEPTH_WITHOUT_EDGES};
use super::follow::{Asked, Fault, ROOT, Traced, planted, trace_ticks};
use super::poses;
use super::queries::{Counted, Kind, Proven, beside, rounds};
use super::sided::RING;
use super::tracked::{TRACKED, TRACKED_WITHOUT_EDGES};
use super::walk::UNIT;
use crate::probe::script::{Table, are_clear, bounded};
use crate::probe::ticks::Script;
use crate::probe::{COUNTING, run_on_board};

/// A part of the name of their function in the probe.
const CLOSEST: &str = "closest<dibs_nostd::surface::moving::SurfaceBlend";

/// Ticks within a budget: of the closest pair without a side, then with side and depth.
pub const TICKS: [Kind; 2] = [
    Kind {
        name: "capsule, a tracker's tick on a moving surface",
        id: "tick",
        root: CLOSEST,
        is_capsule: true,
        table: Table::Moving,
        is_signed: false,
        facts: &TRACKED,
        fitted: None,
    },
    Kind {
        name: "capsule, a tracker's tick with side and depth",
        id: "tick-depth",
        root: CLOSEST,
        is_capsule: true,
        table: Table::Moving,
        is_signed: true,
        facts: &TRACKED_DEPTH,
        fitted: None,
    },
];

/// The [`Fallback`](dibs_nostd::Fallback) of an answer after which a whole query follows: its tests count more than once.
const FULL: u32 = 4;

/// The due triangles of a leaf are counted before the first of them, which the budget may not cover.
const MAX_LEAF: i64 = 8;

/// Ticks from frame to frame.
const FRAME: u32 = 33;

/// Ticks in a row.
struct Ticks {
    bytes: Vec<u8>,
    /// Roots of the tree besides the first.
    roots: i64,
}

impl Ticks {
    /// Ticks on a surface between two frames. `next` gives start and span of the axis and the budget of a tick, from its
    /// number, the number of vertices, and their positions now.
    fn on(
        (mesh, motion): &(Mesh, Motion),
        is_signed: bool,
        ticks: u32,
        mut next: impl FnMut(u32, usize, &dyn Fn(usize) -> Vec3) -> (Vec3, Vec3, u32),
    ) -> Result<Self> {
        let built = Builder::new().index(IndexWidth::Bits16).stretch(2.0).build(mesh)?;
        let roots = i64::from(built.tree::<u16>()?.roots() - 1);
        let rows: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
        if is_signed {
            let triangles = bounded("the surface", &built, RING)?;
            ensure!(rows.iter().all(|rows| are_clear(&triangles, rows)), "a triangle is flat");
        }
        let kind = tick::INTERPOLATED | if is_signed { tick::SIGNED } else { 0 };
        let mut script = Script::new(&built, &rows[0]);
        for number in 0..ticks {
            let at_frame = |after: u32| &rows[(after + number / FRAME) as usize % rows.len()];
            let (before, after) = (at_frame(0), at_frame(1));
            let share = (number % FRAME) as f32 / FRAME as f32;
            if number % FRAME == 0 {
                script.frame(after);
            }
            let now = |row: usize| before[row].lerp(after[row], share);
            let (start, span, budget) = next(number, after.len(), &now);
            let tool = Capsule::new(start, start + span, 2.5)?;
            script.tick(kind | budget << tick::BUDGET, share, &tool);
        }
        Ok(Self { bytes: script.end(), roots })
    }

    /// A tool that starts in the middle of a surface, wanders about, and leaps now and then. Each tick has another
    /// budget, from hardly any to more than enough.
    fn about(surface: &(Mesh, Motion), is_signed: bool, ticks: u32, seed: u64) -> Result<Self> {
        let mut rng = Rng::with_seed(seed);
        let (mut at, mut axis, mut way) = (Vec3::ZERO, Vec3::X * 0.1, Vec3::ZERO);
        Self::on(surface, is_signed, ticks, |_, count, vertex| {
            if rng.u32(..if is_signed { 8 } else { 40 }) == 0 {
                let vertex = vertex(rng.usize(..count));
                at = vertex * [0.0, 0.5, 1.0][rng.usize(..3)]
                    + unit(&mut rng) * 20.0 * rng.f32() * rng.f32();
                axis = unit(&mut rng) * 80.0 * rng.f32();
                // On a vertex many triangles may be the closest, and decide the side.
                if is_signed && rng.bool() {
                    at = vertex + unit(&mut rng) * 10_f32.powf(6.0 * rng.f32() - 5.0);
                    way = Vec3::ZERO;
                }
            }
            if rng.u32(..10) == 0 {
                way = unit(&mut rng) * 10_f32.powf(rng.f32() * 2.5 - 2.0);
            }
            at += way;
            (at, axis, 1 + 2_f32.powf(rng.f32() * 13.0) as u32)
        })
    }

    /// The same with the tools of [`poses`], with side.
    fn posed(surface: &(Mesh, Motion), ticks: u32, seed: u64) -> Result<Self> {
        let mut rng = Rng::with_seed(seed);
        Self::on(surface, true, ticks, |number, count, vertex| {
            poses::tool(number, count, vertex, &mut rng)
        })
    }

    /// The counts of each tick, with its instructions and its fallback.
    fn read(&self, words: &[u32]) -> impl Iterator<Item = ([i64; 3], u64, u32)> {
        let (answers, _) = words.as_chunks::<ANSWER_WORDS>();
        answers.iter().map(|&[took, _, nodes, triangles, fallback, ..]| {
            let counts = [self.roots, i64::from(nodes), i64::from(triangles)];
            // The board's clock counts 1.6 for each instruction.
            (counts, u64::from(took) * 5 / 8, fallback)
        })
    }
}

/// Ticks about a heart, a coarse one, three hearts in one tree, or with side a small ball, and a large one: from the
/// middle of a ball all is equally far, and the front is soon full. With side, half of the ticks are with the tools of [`poses`].
fn scripts(is_signed: bool, ticks: u32, seed: u64) -> Result<Vec<Ticks>> {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272)?;
    let coarse = trembling(1_280, 4, seed);
    let third = if is_signed { breathing(ball(2)) } else { beside(&coarse, 3) };
    let all = [(mesh, motion), coarse, third, breathing(ball(5))];
    let posed = if is_signed { &poses::surfaces()[..] } else { &[] };
    let [of_each, of_posed] = if is_signed { [ticks / 8, ticks / 6] } else { [ticks / 4, 0] };
    let about = |(one, seed)| Ticks::about(one, is_signed, of_each, seed);
    let with_tools =
        |(mesh, seed): (&Mesh, _)| Ticks::posed(&breathing(mesh.clone()), of_posed, seed);
    all.iter().zip(seed..).map(about).chain(posed.iter().zip(seed..).map(with_tools)).collect()
}

/// A surface that grows and shrinks.
fn breathing(mesh: Mesh) -> (Mesh, Motion) {
    let frames = [1.0, 1.02].map(|by| mesh.positions.iter().map(|&at| at * by).collect());
    let motion = Motion { frames: frames.to_vec(), ..Motion::default() };
    (mesh, motion)
}

/// Proves the bound, counts the instructions of many ticks, and compares each with it.
pub fn count(proven: &Proven, probe: &Path, ticks: usize) -> Result<Counted> {
    let mut found = Counted::default();
    for (ticks, seed) in rounds(ticks) {
        for script in scripts(proven.kind.is_signed, ticks as u32, seed + 71)? {
            let words = run_on_board(probe, &script.bytes, COUNTING)?;
            for (counts, instructions, _) in script.read(&words) {
                found.add(i128::from(instructions) * UNIT, proven.at(counts));
            }
        }
    }
    Ok(found.end())
}

/// Follows ticks, instruction by instruction.
pub fn trace(proven: &Proven, probe: &Path, ticks: u32) -> Result<Traced> {
    trace_scripts(proven, probe, &scripts(proven.kind.is_signed, ticks, 81)?)
}

fn trace_scripts(proven: &Proven, probe: &Path, scripts: &[Ticks]) -> Result<Traced> {
    let is_signed = proven.kind.is_signed;
    let bytes = scripts.iter().map(|script| script.bytes.as_slice());
    trace_ticks(proven, probe, bytes, |script, words| {
        let ticks = scripts[script].read(words);
        let asked = |(counts, _, fallback)| Asked {
            counts,
            // With side, work besides tests is counted in parts that need not all be done.
            spare: (!is_signed && fallback != FULL).then_some(ROOT + MAX_LEAF),
        };
        ticks.map(asked).collect()
    })
}

/// Whether a trace finds each of two planted errors, in each kind.
pub fn faults(probe: &Path) -> impl Iterator<Item = Result<[bool; 2]>> {
    let shorter = [&TRACKED_WITHOUT_EDGES, &TRACKED_DEPTH_WITHOUT_EDGES];
    TICKS.iter().zip(shorter).map(move |(kind, shorter)| {
        let fault = Fault { narrowed: "visits without a price", shorter };
        let surface = trembling(1_280, 4, 91);
        let script = [Ticks::about(&surface, kind.is_signed, 20, 91)?];
        planted(kind, probe, &fault, |proven| trace_scripts(&proven, probe, &script))
    })
}

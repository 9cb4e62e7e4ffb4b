//! A tracker's instructions on the board: the paper's moving tool around a heart that moves at every tick.

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, IndexWidth, generate};
use dibs_nostd::{Capsule, Tool};
use dibs_tests::method::Probe;
use dibs_tests::streams::{Beat, TICK_RATE};
use glam::{Quat, Vec3};
use probe::track::{ANSWER_WORDS, JOINTS, command, tick};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

pub const CHECK: Check = Check {
    name: "a tracker on the board",
    run: check,
    promises: &[
        Promise {
            id: "m7.track.mean",
            says: "The mean tick of a tracker on table 3's path: the closest pair, the surface interpolated, another at \
                   every tick",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.99}, at most {m7.track.largest}; {m7.track.node-tests} node and \
         {m7.track.triangle-tests} triangle tests. A whole query, warm, took {m7.track.whole}",
            limits: "The generated heart of 10,272 triangles, a capsule, limit 1.5, {m7.track.ticks} ticks in a row, the \
         first aside. Without the side of the surface. Emulated Cortex-M7; instructions, not cycles.",
        },
        golden("m7.track.99"),
        golden("m7.track.largest"),
        golden("m7.track.node-tests"),
        note("m7.track.triangle-tests"),
        note("m7.track.whole"),
        note("m7.track.ticks"),
        Promise {
            id: "m7.track.apart",
            says: "How far a tracker's separation is from a whole query's",
            criterion: TIMING,
            bound: Bound::AtMost(1.0),
            unit: "of the accuracy that both state, at most",
            limits: "As above, both on the board; the surface interpolated and held.",
        },
        Promise {
            id: "m7.track.fallbacks",
            says: "Ticks that were whole queries",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "ticks but the first",
            limits: "As above. 256 opened nodes are remembered.",
        },
        golden("m7.track.held.mean"),
        golden("m7.track.held.largest"),
        Promise {
            id: "m7.track.signed.mean",
            says: "The mean tick with the side, and with the depth where the axis crosses",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.signed.99}, at most {m7.track.signed.largest}",
            limits: "As above.",
        },
        note("m7.track.signed.99"),
        golden("m7.track.signed.largest"),
        Promise {
            id: "m7.track.contacts.mean",
            says: "The mean tick with the side and all contacts within 5 mm",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.contacts.99}, at most {m7.track.contacts.largest}",
            limits: "As above. Contacts within the margin take a range search at every tick.",
        },
        note("m7.track.contacts.99"),
        golden("m7.track.contacts.largest"),
        Promise {
            id: "m7.track.chain.mean",
            says: "The mean tick of a chain of eight capsules, each with its tracker",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.chain.99}, at most {m7.track.chain.largest}; \
                   {m7.track.chain.searched} of the eight are searched in the mean",
            limits: "As above, without the side of the surface; the first capsule is table 3's.",
        },
        note("m7.track.chain.99"),
        golden("m7.track.chain.largest"),
        note("m7.track.chain.searched"),
    ],
};

/// The tool goes once through the middle of the heart and back. The number is fixed, since golden figures are compared.
const TICKS: u32 = 7_000;

/// A run over the path: the end of its figures' names, and the bits of its ticks.
const RUNS: [(&str, u32); 5] = [
    ("", tick::INTERPOLATED),
    (".held", 0),
    (".signed", tick::INTERPOLATED | tick::SIGNED),
    (".contacts", tick::INTERPOLATED | tick::SIGNED | tick::CONTACTS),
    (".chain", tick::INTERPOLATED | tick::CHAIN),
];

/// The heart as it beats, and the tool of table 3 at each tick.
fn script(bits: u32) -> Vec<u8> {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5);
    let built = builder.build(&mesh).expect("a valid mesh");
    let mut bytes = (built.blob().len() as u32).to_le_bytes().to_vec();
    bytes.extend(built.blob());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let put = |bytes: &mut Vec<u8>, words: &[u32]| {
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    let put_points = |bytes: &mut Vec<u8>, points: &[Vec3]| {
        bytes.extend(points.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
    };
    let put_frame = |bytes: &mut Vec<u8>, number: usize| {
        put(bytes, &[command::FRAME]);
        put_points(bytes, &built.to_rows(&motion.frames[number % motion.frames.len()]));
    };
    let beat = Beat::new(&motion);
    put_frame(&mut bytes, 0);
    let mut last = None;
    for tick in 0..TICKS {
        let time = tick as f32 / TICK_RATE * motion.rate;
        let frame = time as usize;
        if last.replace(frame) != Some(frame) {
            put_frame(&mut bytes, frame + 1);
        }
        let Probe::Capsule(tool) = beat.tool(tick) else { panic!("a capsule") };
        put(&mut bytes, &[command::TICK, bits, time.fract().to_bits()]);
        let joints = joints(&tool);
        put_points(&mut bytes, if bits & tick::CHAIN == 0 { &joints[..2] } else { &joints });
        put(&mut bytes, &[tool.radius().to_bits()]);
    }
    put(&mut bytes, &[command::END]);
    bytes
}

/// The ends of a chain whose first link is the tool, each link turned by a tenth of a radian against the one before.
fn joints(tool: &Capsule) -> [Vec3; JOINTS] {
    let mut link = tool.end() - tool.start();
    let mut joints = [tool.start(); JOINTS];
    for at in 1..JOINTS {
        joints[at] = joints[at - 1] + link;
        link = Quat::from_rotation_y(0.1) * link;
    }
    joints
}

/// One answer of the probe.
struct Tick {
    instructions: u32,
    whole: u32,
    tests: [u32; 2],
    searched: u32,
    is_fallback: bool,
    apart: f32,
}

fn read(words: &[u32]) -> Result<Vec<Tick>> {
    // The board's clock counts 1.6 to each instruction.
    let instructions = |clock: u32| (u64::from(clock) * 5 / 8) as u32;
    let (answers, rest) = words.as_chunks::<ANSWER_WORDS>();
    ensure!(rest.is_empty(), "an answer is not whole");
    Ok(answers
        .iter()
        .map(|&[took, whole, nodes, triangles, fallback, searched, _, apart]| Tick {
            instructions: instructions(took),
            whole: instructions(whole),
            tests: [nodes, triangles],
            searched,
            is_fallback: fallback != 0,
            apart: f32::from_bits(apart),
        })
        .collect())
}

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let [plain, every] =
        [build_for_board(&board()?, "track")?, build_for_board(&board()?, "chain")?];
    let (mut apart, mut fallbacks) = (0.0_f32, 0);
    for (name, bits) in RUNS {
        let program = if bits & !tick::INTERPOLATED == 0 { &plain } else { &every };
        let ticks = run_on_board(program, &script(bits), COUNTING);
        let ticks = read(&ticks.with_context(|| format!("the run \"{name}\""))?)?;
        ensure!(ticks.len() == TICKS as usize, "{} ticks of {TICKS} answered", ticks.len());
        let ticks = &ticks[1..];
        let mut taken: Vec<u32> = ticks.iter().map(|tick| tick.instructions).collect();
        taken.sort_unstable();
        let mean = |of: &dyn Fn(&Tick) -> u32| {
            ticks.iter().map(|tick| f64::from(of(tick))).sum::<f64>() / ticks.len() as f64
        };
        let at = |share: f64| f64::from(taken[((taken.len() - 1) as f64 * share) as usize]);
        figures.note(&format!("m7.track{name}.mean"), mean(&|tick| tick.instructions).round());
        figures.note(&format!("m7.track{name}.largest"), at(1.0));
        if bits != 0 {
            figures.note(&format!("m7.track{name}.99"), at(0.99));
        }
        if bits & tick::CHAIN != 0 {
            let searched = mean(&|tick| tick.searched);
            figures.note("m7.track.chain.searched", (searched * 100.0).round() / 100.0);
        }
        if name.is_empty() {
            for (kind, row) in [("node", 0), ("triangle", 1)] {
                let tests = mean(&|tick| tick.tests[row]);
                figures.note(&format!("m7.track.{kind}-tests"), (tests * 10.0).round() / 10.0);
            }
            figures.note("m7.track.whole", mean(&|tick| tick.whole).round());
            figures.note("m7.track.ticks", f64::from(TICKS));
        }
        apart = ticks.iter().fold(apart, |apart, tick| apart.max(tick.apart));
        // A capsule of a chain that was far for long may have moved too far.
        let counted = if bits & tick::CHAIN == 0 { ticks } else { &[] };
        fallbacks += counted.iter().filter(|tick| tick.is_fallback).count();
    }
    figures.note("m7.track.apart", f64::from((apart * 1e4).round() / 1e4));
    figures.note("m7.track.fallbacks", fallbacks as f64);
    Ok(Outcome::Passed)
}

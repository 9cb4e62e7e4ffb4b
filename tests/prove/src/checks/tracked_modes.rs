//! A tracker's instructions on the board on a surface that weights move: the paper's moving tool around a heart whose
//! modes move at every tick.

// Requirements: F-06, T-01

use anyhow::{Context, Result, ensure};
use dibs_build::modes::ModalFit;
use dibs_build::{Builder, IndexWidth};
use dibs_nostd::Tool;
use dibs_tests::method::Probe;
use dibs_tests::motions::trembling;
use dibs_tests::streams::{Beat, TICK_RATE};
use glam::Vec3;
use probe::weights::{ANSWER_WORDS, OPENED, command};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

pub const CHECK: Check = Check {
    name: "a tracker on modal surfaces on the board",
    run: check,
    promises: &[
        Promise {
            id: "m7.track.modes.8.mean",
            says: "The mean tick of a tracker on a surface of 8 modes, on table 3's path: weights interpolated, others at \
                   every tick",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.modes.8.99}, at most {m7.track.modes.8.largest}; \
                   {m7.track.modes.8.node-tests} node tests. A whole query, warm, took {m7.track.modes.8.whole}",
            limits: "The generated heart of 10,272 triangles with waves over it, a capsule, limit 2, \
                     {m7.track.modes.ticks} ticks in a row, the first aside. The surface's making is counted. Without \
                     the side of the surface. Emulated Cortex-M7; instructions, not cycles.",
        },
        note("m7.track.modes.8.99"),
        golden("m7.track.modes.8.largest"),
        note("m7.track.modes.8.node-tests"),
        note("m7.track.modes.8.whole"),
        note("m7.track.modes.ticks"),
        Promise {
            id: "m7.track.modes.24.mean",
            says: "The same with 24 modes",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.modes.24.99}, at most {m7.track.modes.24.largest}; \
                   {m7.track.modes.24.node-tests} node tests. A whole query, warm, took {m7.track.modes.24.whole}",
            limits: "As above.",
        },
        note("m7.track.modes.24.99"),
        golden("m7.track.modes.24.largest"),
        note("m7.track.modes.24.node-tests"),
        note("m7.track.modes.24.whole"),
        Promise {
            id: "m7.track.modes.apart",
            says: "How far a tracker's separation on a modal surface is from a whole query's",
            criterion: TIMING,
            bound: Bound::AtMost(1.0),
            unit: "of the accuracy that both state, at most",
            limits: "As above, both on the board.",
        },
        Promise {
            id: "m7.track.modes.fallbacks",
            says: "Ticks on modal surfaces that were whole queries",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "ticks but the first",
            limits: "As above. The tracker has places for {m7.track.modes.places} opened nodes.",
        },
        note("m7.track.modes.places"),
    ],
};

/// Numbers of modes.
const MODES: [usize; 2] = [8, 24];

/// As on the surface of vertices: once through the middle of the heart and back.
const TICKS: u32 = 7_000;

fn script(modes: usize) -> Result<Vec<u8>> {
    let (mesh, motion) = trembling(10_272, modes.div_ceil(2), 41);
    let builder = Builder::new().index(IndexWidth::Bits16).stretch(2.0);
    let built = builder.build(&mesh)?.with_modes(&ModalFit::new(&mesh, &motion)?, modes)?;
    let recorded = built.modal_motion().context("it has modes")?;
    ensure!(recorded.beyond_limit.is_empty(), "frames beyond the limit");
    let mut bytes = (modes as u32).to_le_bytes().to_vec();
    bytes.extend((built.blob().len() as u32).to_le_bytes());
    bytes.extend(built.blob());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let put = |bytes: &mut Vec<u8>, words: &[u32]| {
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    let put_floats = |bytes: &mut Vec<u8>, floats: &[f32]| {
        bytes.extend(floats.iter().flat_map(|float| float.to_le_bytes()));
    };
    let frames_a_tick = motion.rate / TICK_RATE;
    let beat = Beat::new(&motion);
    let mut sent = 0;
    for tick in 0..TICKS {
        // A frame is sent at the tick that reaches its time.
        while sent as f32 <= tick as f32 * frames_a_tick {
            put(&mut bytes, &[command::FRAME, (sent as f32 / frames_a_tick).ceil() as u32]);
            put_floats(&mut bytes, &recorded.weights[sent % recorded.weights.len()]);
            sent += 1;
        }
        let Probe::Capsule(tool) = beat.tool(tick) else { anyhow::bail!("no capsule") };
        put(&mut bytes, &[command::TICK, tick]);
        let ends: [Vec3; 2] = [tool.start(), tool.end()];
        put_floats(&mut bytes, ends.map(|end| end.to_array()).as_flattened());
        put_floats(&mut bytes, &[Tool::radius(&tool)]);
    }
    put(&mut bytes, &[command::END]);
    Ok(bytes)
}

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "weights")?;
    let (mut apart, mut fallbacks) = (0.0_f32, 0);
    for modes in MODES {
        let words = run_on_board(&program, &script(modes)?, COUNTING)?;
        let (ticks, rest) = words.as_chunks::<ANSWER_WORDS>();
        ensure!(rest.is_empty() && ticks.len() == TICKS as usize, "not every tick is answered");
        let ticks = &ticks[1..];
        // The board's clock counts 1.6 for each instruction.
        let instructions = |clock: u32| (u64::from(clock) * 5 / 8) as u32;
        let mut taken: Vec<u32> = ticks.iter().map(|tick| instructions(tick[0])).collect();
        taken.sort_unstable();
        let mean = |of: &dyn Fn(&[u32; ANSWER_WORDS]) -> u32| {
            ticks.iter().map(|tick| f64::from(of(tick))).sum::<f64>() / ticks.len() as f64
        };
        let mut note =
            |name: &str, value: f64| figures.note(&format!("m7.track.modes.{modes}.{name}"), value);
        let at = |share: f64| f64::from(taken[((taken.len() - 1) as f64 * share) as usize]);
        note("mean", mean(&|tick| instructions(tick[0])).round());
        note("99", at(0.99));
        note("largest", at(1.0));
        note("whole", mean(&|tick| instructions(tick[1])).round());
        note("node-tests", (mean(&|tick| tick[2]) * 10.0).round() / 10.0);
        fallbacks += ticks.iter().filter(|tick| tick[4] != 0).count();
        apart = ticks.iter().fold(apart, |apart, tick| apart.max(f32::from_bits(tick[5])));
    }
    figures.note("m7.track.modes.ticks", f64::from(TICKS));
    figures.note("m7.track.modes.places", OPENED as f64);
    figures.note("m7.track.modes.apart", f64::from((apart * 1e4).round() / 1e4));
    figures.note("m7.track.modes.fallbacks", fallbacks as f64);
    Ok(Outcome::Passed)
}

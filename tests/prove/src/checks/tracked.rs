//! A tracker's instructions on the board: the paper's moving tool around a heart that moves at every tick.

// Requirements: E-01, T-01

use anyhow::{Context, Result};
use dibs_build::{Builder, IndexWidth, generate};
use probe::track::{OPENED, tick};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::ticks::{Tick, read, script};
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
            says: "How far a tracker's certified interval is from a whole query's",
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
            limits: "As above. The tracker has places for {m7.track.places} opened nodes.",
        },
        note("m7.track.places"),
        golden("m7.track.held.mean"),
        golden("m7.track.held.largest"),
        Promise {
            id: "m7.track.side.mean",
            says: "The mean tick with the side, and any depth where the axis crosses",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions; 99 % below {m7.track.side.99}, at most {m7.track.side.largest}",
            limits: "As above. Table 6 of benchmarks.md has other surfaces.",
        },
        note("m7.track.side.99"),
        golden("m7.track.side.largest"),
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
            limits: "As above. The list remembers which parts of the surface are beyond the margin; all within it are compared.",
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
            limits: "As above, with the side, and any depth where an axis crosses; the first capsule is table 3's.",
        },
        note("m7.track.chain.99"),
        golden("m7.track.chain.largest"),
        note("m7.track.chain.searched"),
    ],
};

/// The tool moves once through the middle of the heart and back. Fixed, because golden figures are compared.
const TICKS: u32 = 7_000;

/// A run over the path: the suffix of its figures' names, the options of its ticks, and the probe's program.
const RUNS: [(&str, u32, &str); 6] = [
    ("", tick::INTERPOLATED, "track"),
    (".held", 0, "track"),
    (".side", tick::INTERPOLATED | tick::SIDE, "side"),
    (".signed", tick::INTERPOLATED | tick::SIGNED, "chain"),
    (".contacts", tick::INTERPOLATED | tick::SIGNED | tick::CONTACTS, "chain"),
    (".chain", tick::INTERPOLATED | tick::CHAIN | tick::SIDE, "chain"),
];

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272)?;
    let built = Builder::new().index(IndexWidth::Bits16).stretch(1.5).build(&mesh)?;
    let (mut apart, mut fallbacks) = (0.0_f32, 0);
    for (name, bits, program) in RUNS {
        let program = build_for_board(&board()?, program)?;
        let ticks = run_on_board(&program, &script(&built, &motion, bits, TICKS)?, COUNTING);
        let ticks = read(&ticks.with_context(|| format!("the run \"{name}\""))?, TICKS)?;
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
            figures.note("m7.track.places", OPENED as f64);
        }
        apart = ticks.iter().fold(apart, |apart, tick| apart.max(tick.apart));
        // A tool of a chain that was far away for a long time may have moved too far.
        let counted = if bits & tick::CHAIN == 0 { &ticks[..] } else { &[] };
        fallbacks += counted.iter().filter(|tick| tick.is_fallback).count();
    }
    figures.note("m7.track.apart", f64::from((apart * 1e4).round() / 1e4));
    figures.note("m7.track.fallbacks", fallbacks as f64);
    Ok(Outcome::Passed)
}

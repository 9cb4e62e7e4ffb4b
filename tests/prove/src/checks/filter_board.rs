//! A filter of commands on the emulated board: the walks of the host, with the same bits, and their instructions.

// Requirement: C-05

use anyhow::Result;
use dibs_build::{Builder, generate};
use dibs_tests::filter::{
    Episode, Scene, Tally, glide_told, labelled_scenes, scenes, walk_by_label, walk_told,
};
use fastrand::Rng;
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{EDGES, FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};
use crate::probe::filter::{Script, Tick};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

pub const CHECK: Check = Check {
    name: "a filter on the board",
    run: check,
    promises: &[
        note("filter.board.ticks"),
        note("filter.board.near"),
        Promise {
            id: "filter.board.different",
            says: "A filter on the board admits the motions of this computer, to the bit",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {filter.board.ticks} ticks, with the certified separation, the reason and the cost",
            limits: "Both follow the motions that were admitted. A part of the walks of the filter on this computer, with other seeds: \
                     corners, gaps, a plate of 0.2 mm, tissue at its limit of speed, late and lost frames, climbing commands.",
        },
        Promise {
            id: "filter.board.violations",
            says: "No motion admitted on the board comes nearer than the stand-off less 0.02 mm at any instant, unless the reason says \
                   that none is safe",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {filter.board.judged} ticks of walks, {filter.board.near} of them within 5 mm; {filter.board.unsafe} had no safe \
                   motion",
            limits: "Truth by exhaustive search in f64 at six instants of a tick.",
        },
        note("filter.board.judged"),
        note("filter.board.unsafe"),
        Promise {
            id: "filter.board.mean",
            says: "A tick of two capsules on the beating heart takes, on the board",
            criterion: TIMING,
            bound: Bound::AtMost(60_000.0),
            unit: "instructions in the mean of {filter.board.glides} ticks, rows and all",
            limits: "10,272 triangles, 1 kHz, 200 mm/s, in free space, against and along the wall; after the first 100 ticks.",
        },
        note("filter.board.glides"),
        Promise {
            id: "filter.board.most",
            says: "The most of these",
            criterion: TIMING,
            bound: Bound::AtMost(200_000.0),
            unit: "instructions; {filter.board.start} in the first 100 ticks",
            limits: "The budget is 200,000.",
        },
        note("filter.board.start"),
        Promise {
            id: "filter.board.over",
            says: "No tick takes more than its budget on the board, rows and all",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {filter.board.ticks} ticks, with budgets of 30,000, 60,000 and 200,000 instructions; at most {filter.board.share} % \
                   of one",
            limits: "The same walks and glides, their first ticks included; a sixth of the walks with a label whose stand-off is 2 mm larger. Without \
                     rows of the caller. Measured, not proven: the prices of work are typical.",
        },
        note("filter.board.share"),
    ],
};

/// Number of ticks in which the trackers of a glide start.
const START: usize = 100;

/// A label with a stand-off of its own.
const VESSEL: u8 = 2;

/// Triangles and stretch of the heart.
const HEART: (u32, f32) = (10_272, 1.5);

/// Walks on one scene.
struct Walked {
    script: Script,
    tally: Tally,
}

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "filter")?;
    let ask = |script: &Script| -> Result<Vec<Tick>> {
        script.read(&run_on_board(&program, &script.bytes(), COUNTING)?)
    };
    let most = |ticks: &[Tick]| ticks.iter().map(|tick| tick.instructions).max().unwrap_or(0);
    let (mut sum, mut glides) = (Tally::default(), Vec::new());
    let (mut count, mut different, mut over, mut share) = (0, 0, 0, 0.0_f64);
    let mut compare = |ticks: &[Tick]| {
        count += ticks.len();
        for tick in ticks {
            different += usize::from(!tick.is_same);
            over += usize::from(tick.instructions > tick.budget);
            share = share.max(f64::from(tick.instructions) / f64::from(tick.budget));
        }
    };
    let mut most_at_start = 0;
    for Walked { script, tally } in walks(effort) {
        compare(&ask(&script)?);
        sum += tally;
    }
    let generate::MovingMesh { mesh, motion } = generate::heart(HEART.0)?;
    let built = Builder::new().stretch(HEART.1).build(&mesh)?;
    for seed in 0..effort.board_glides {
        let mut script = Script::new(&built, true);
        let settings = (effort.board_glide_ticks, seed + 11, 0.0);
        let _ = glide_told(&mesh, &motion, HEART.1, settings, &mut script);
        let ticks = ask(&script)?;
        compare(&ticks);
        let (start, rest) = ticks.split_at(START.min(ticks.len()));
        most_at_start = most_at_start.max(most(start));
        glides.extend(rest.iter().map(|tick| tick.instructions));
    }
    let of_glides: f64 = glides.iter().map(|&one| f64::from(one)).sum();
    figures.note("filter.board.ticks", count as f64);
    figures.note("filter.board.near", sum.near as f64);
    figures.note("filter.board.different", different as f64);
    figures.note("filter.board.violations", (sum.violations + sum.too_fast + sum.uncertain) as f64);
    figures.note("filter.board.unsafe", sum.unsafe_ticks as f64);
    figures.note("filter.board.judged", sum.ticks as f64);
    figures.note("filter.board.mean", (of_glides / glides.len() as f64).round());
    figures.note("filter.board.glides", glides.len() as f64);
    figures.note("filter.board.most", f64::from(glides.iter().copied().max().unwrap_or(0)));
    figures.note("filter.board.start", f64::from(most_at_start));
    figures.note("filter.board.over", over as f64);
    figures.note("filter.board.share", (1e3 * share).round() / 10.0);
    Ok(Outcome::Passed)
}

/// The same number of walks on each scene; and of these scenes with a label, a fifth as many.
fn walks(effort: &Effort) -> Vec<Walked> {
    let plain = scenes();
    let labelled = labelled_scenes(|from_middle| if from_middle.x > 2.0 { VESSEL } else { 0 });
    let each = effort.board_walks.div_ceil(plain.len() as u64);
    let on = |scenes: &[Scene], each: u64, is_labelled: bool| {
        let walked = scenes.par_iter().enumerate().map(|(number, scene)| {
            let mut walked =
                Walked { script: Script::new(&scene.tree, false), tally: Tally::default() };
            for walk in 0..each {
                // Seeds that the check on the host does not use.
                let seed = 1_000_000 + walk * scenes.len() as u64 + number as u64;
                let episode = Episode::any(&mut Rng::with_seed(seed));
                let told = &mut walked.script;
                walked.tally += if is_labelled {
                    walk_by_label(scene, &episode, [(VESSEL, 2.0)], seed, told)
                } else {
                    walk_told(scene, &episode, seed, told)
                };
            }
            walked
        });
        walked.collect::<Vec<_>>()
    };
    let mut walked = on(&plain, each, false);
    walked.extend(on(&labelled, each.div_ceil(5), true));
    walked
}

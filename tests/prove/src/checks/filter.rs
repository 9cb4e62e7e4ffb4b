//! A filter of commands on adversarial walks, compared with other ways to hold an instrument.

// Requirements: C-05, C-06

use anyhow::{Result, ensure};
use dibs_build::generate;
use dibs_tests::filter::{Episode, Glided, Tally, glide, scenes, walk};
use dibs_tests::hand::{self, Pushed};
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

pub const CHECK: Check = Check {
    name: "a filter on this computer",
    run: check,
    promises: &[
        Promise {
            id: "filter.violations",
            says: "No admitted motion comes nearer than the stand-off less 0.02 mm at any instant, unless the reason says that none is safe",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {filter.ticks} ticks, {filter.near} of them within 5 mm; the worst was {filter.worst} mm below",
            limits: "Two capsules, ten scenes: corner, groove, gaps, spike, plate of 0.2 mm, ball, heart, brain; tissue at its limit of \
                     up to 300 mm/s, swinging, waving, drifting, closing; frames at irregular times, late and lost; periods of 0.5 to 4 ms; an eighth of the \
                     walks take the worst of three commands, and an eighth lead to the medial axis. Truth by exhaustive search in f64 at six instants of a tick. \
                     Residual and position error are 0 here, and no frame is extrapolated: these only add to the stand-off \
                     (query/filter.rs). Without rows of the caller (query/filter.rs has them); two surfaces are query/filter_of_scene.rs, a climb over \
                     settings is query/filter_climb.rs.",
        },
        Promise {
            id: "filter.uncertain",
            says: "No separation is less than was certified, with or without a safe motion",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {filter.ticks} ticks; {filter.unsafe} had no safe motion, and {filter.below} of these came below the stand-off",
            limits: "The same walks. The tissue may be faster than the robot, and late frames may leave no room.",
        },
        Promise {
            id: "filter.cries",
            says: "Where there is a way out, a tool that keeps its stand-off seldom loses its safe motion",
            criterion: FLOW,
            bound: Bound::AtMost(100.0),
            unit: "of a million such ticks lost it, and said so; there were {filter.easy}",
            limits: "Of these walks the ones about a spike, a plate or a ball, with every frame new, a robot twice as fast as the \
                     tissue, and the whole budget.",
        },
        Promise {
            id: "filter.over",
            says: "No tick counts more instructions than its budget",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {filter.ticks} ticks, with budgets of 30,000, 60,000 and 200,000; {filter.most} by the cost model at most",
            limits: "The same walks. Searches, rows, paths and estimates, each at its price; what they take is measured on the board.",
        },
        note("filter.most"),
        Promise {
            id: "filter.mean",
            says: "On a beating heart a tick of two capsules is cheap",
            criterion: TIMING,
            bound: Bound::AtMost(60_000.0),
            unit: "instructions in the mean by the cost model, {filter.glide.most} at most, {filter.glide.queries} queries",
            limits: "10,272 triangles, 1 kHz, 200 mm/s, in free space, against and along the wall; after the first 100 ticks.",
        },
        Promise {
            id: "filter.along",
            says: "Along a wall a filter does not brake",
            criterion: FLOW,
            bound: Bound::AtLeast(95.0),
            unit: "% of the commanded speed along one wall, at the least of {filter.glide.along} ticks",
            limits: "The same glides, with new frames, and as many with a stated error of registration of 0.5 mm.",
        },
        Promise {
            id: "filter.free",
            says: "In free space a command is admitted whole",
            criterion: FLOW,
            bound: Bound::Is(100.0),
            unit: "% of {filter.glide.free} ticks",
            limits: "The same ticks.",
        },
        Promise {
            id: "filter.deepest",
            says: "A hand's commands do not get in when they are filtered",
            criterion: FLOW,
            bound: Bound::AtMost(0.02),
            unit: "mm of penetration at the deepest, within 2,000,000 instructions a tick; {filter.rows} mm by velocity rows alone, {filter.proxy} mm by the force of all \
                   contacts, {filter.force} mm or more by that of the closest pair",
            limits: "An instrument of 1 mm radius, no stand-off, in the hand's six scenes; forces of at most 5 N against 4.5 N, commands of \
                     225 mm/s, rows of a gain of 100/s with the surface's velocity. Beyond 10 mm a push ends.",
        },
        note("filter.easy"),
        note("filter.ticks"),
        note("filter.near"),
        note("filter.worst"),
        note("filter.unsafe"),
        note("filter.below"),
        note("filter.glide.most"),
        note("filter.glide.queries"),
        note("filter.glide.along"),
        note("filter.glide.free"),
        note("filter.rows"),
        note("filter.proxy"),
        note("filter.force"),
    ],
};

/// A stated error of registration (mm).
const REGISTRATION: f32 = 0.5;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let scenes = scenes();
    let tallies: Vec<Tally> = (0..effort.walks)
        .into_par_iter()
        .map(|seed| {
            let scene = &scenes[seed as usize % scenes.len()];
            walk(scene, &Episode::any(&mut Rng::with_seed(seed)), seed)
        })
        .collect();
    let mut sum = Tally::default();
    tallies.into_iter().for_each(|tally| sum += tally);
    ensure!(sum.easy > 0, "no tick is easy");
    let thousandths = |x: f64| (x * 1e3).round() / 1e3;
    figures.note("filter.violations", (sum.violations + sum.too_fast) as f64);
    figures.note("filter.uncertain", sum.uncertain as f64);
    figures.note("filter.cries", (sum.cries as f64 / sum.easy as f64 * 1e6).round());
    figures.note("filter.easy", sum.easy as f64);
    figures.note("filter.over", sum.over_budget as f64);
    figures.note("filter.most", f64::from(sum.most_instructions));
    figures.note("filter.ticks", sum.ticks as f64);
    figures.note("filter.near", sum.near as f64);
    figures.note("filter.worst", thousandths(sum.worst.map_or(0.0, |worst| worst.max(0.0))));
    figures.note("filter.unsafe", sum.unsafe_ticks as f64);
    figures.note("filter.below", sum.below as f64);

    let generate::MovingMesh { mesh, motion } = generate::heart(10_272)?;
    let glides = |registration| -> Vec<Glided> {
        let seeds = (1..4_u64).into_par_iter();
        seeds.map(|seed| glide(&mesh, &motion, 1.5, (3_000, seed), registration)).collect()
    };
    let (glided, registered) = (glides(0.0), glides(REGISTRATION));
    let all = || glided.iter().chain(&registered);
    let count = |of: fn(&Glided) -> f64| glided.iter().map(of).sum::<f64>();
    let ticks = count(|one| f64::from(one.ticks));
    let least = all().fold(f32::INFINITY, |least, one| least.min(one.least_along));
    let most = glided.iter().map(|one| one.most).max().unwrap_or(0);
    figures.note("filter.mean", (count(|one| one.instructions as f64) / ticks).round());
    figures.note("filter.glide.most", f64::from(most));
    figures.note("filter.glide.queries", thousandths(count(|one| one.queries as f64) / ticks));
    figures.note("filter.along", (f64::from(least) * 1e3).round() / 10.0);
    figures.note("filter.glide.along", all().map(|one| f64::from(one.along)).sum());
    let free = count(|one| f64::from(one.free));
    figures.note("filter.free", count(|one| f64::from(one.whole)) / free * 100.0);
    figures.note("filter.glide.free", free);

    let scenes = hand::scenes();
    let deepest = |pushed: Vec<Pushed>| {
        thousandths(pushed.iter().map(|one| f64::from(-one.least)).fold(0.0, f64::max))
    };
    let commanded =
        |is_filtered| scenes.par_iter().map(|scene| scene.command(is_filtered)).collect();
    let pushed = |by_all| scenes.par_iter().map(|scene| scene.push(by_all)).collect();
    figures.note("filter.deepest", deepest(commanded(true)));
    figures.note("filter.rows", deepest(commanded(false)));
    figures.note("filter.proxy", deepest(pushed(true)));
    figures.note("filter.force", deepest(pushed(false)));
    Ok(Outcome::Passed)
}

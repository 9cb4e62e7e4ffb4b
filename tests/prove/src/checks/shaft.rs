//! A tracker's ticks within a budget, for a shaft that is pushed through a whole heart, then a short one wholly
//! inside its wall.

// Requirement: T-02

use anyhow::{Context, Result, ensure};
use dibs_nostd::Side;
use xtask::steps::Outcome;

use super::bounded::force::steps;
use super::bounded::rows::SHAFT;
use super::bounded::scene::truth;
use super::bounded::tally::{AMPLE, Sums, run};
use super::bounded::{largest, width};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, note};
use crate::harness::{Check, Effort};

/// The sums, and of each row the figures that a budget's ticks have.
macro_rules! promises {
    ($($row:literal within $instructions:literal, at most $most:literal: $goals:literal;)*) => {
        &[
            none("shaft.wrong", "The certified interval of a shaft holds the true separation, whatever the budget", "of {shaft.ticks} ticks with each of eight budgets; in the second half the axis is wholly inside at each"),
            note("shaft.ticks"),
            none("shaft.damped", "Once it has settled, no tick of a shaft near the wall leaves the constraint without a spring", "of {shaft.near} ticks within 5 mm, with these budgets"),
            none("shaft.idle", "Once it has settled, no tick of a shaft ends with budget left and an interval wider than a depth's tolerance", "of {shaft.near} ticks within 5 mm, with these budgets"),
            note("shaft.near"),
            $(
                Promise {
                    limits: concat!("The goals were ", $goals, ": not reached. The axis crosses the surface or is inside at every tick near it, so that each also needs a depth. Tried: as for the ticks within a budget, on their path alone."),
                    ..width(
                        concat!("shaft.", $row, ".95"),
                        concat!("A shaft of 120 mm through a whole heart, then one of 6 mm inside its wall, within ", $instructions, " instructions: the interval's width at 95 % of the ticks near the wall"),
                        concat!("mm; 99 %: {shaft.", $row, ".99}, largest {shaft.", $row, ".largest}; in or crossing, 95 %: {shaft.", $row, ".inner}; pair off the deepest and turned: {shaft.", $row, ".turned} %, without a budget {shaft.uncut.turned} %. With the {shaft.", $row, ".bought} tests that `Cost::M7_TICK` buys, 95 %: {shaft.", $row, ".user} mm"),
                        Bound::Informs,
                    )
                },
                note(concat!("shaft.", $row, ".99")),
                note(concat!("shaft.", $row, ".largest")),
                note(concat!("shaft.", $row, ".inner")),
                note(concat!("shaft.", $row, ".turned")),
                note(concat!("shaft.", $row, ".bought")),
                note(concat!("shaft.", $row, ".user")),
                steps(
                    concat!("shaft.", $row, ".size"),
                    concat!("N; of the force {shaft.", $row, ".step} N, more than 0.5 N at {shaft.", $row, ".steps} % of the ticks; without a budget {shaft.uncut.step} N, {shaft.uncut.steps} %"),
                ),
                note(concat!("shaft.", $row, ".step")),
                note(concat!("shaft.", $row, ".steps")),
                largest(
                    concat!("shaft.", $row, ".instructions"),
                    "On the board the largest of these ticks takes",
                    concat!("instructions with {shaft.", $row, ".tests} tests; the mean one {shaft.", $row, ".mean}, the median of those that use the budget up {shaft.", $row, ".spent}"),
                    $most,
                ),
                note(concat!("shaft.", $row, ".mean")),
                note(concat!("shaft.", $row, ".tests")),
                note(concat!("shaft.", $row, ".spent")),
            )*
            note("shaft.uncut.step"),
            note("shaft.uncut.steps"),
            note("shaft.uncut.turned"),
        ]
    };
}

pub const CHECK: Check = Check {
    name: "a shaft within a budget",
    run: check,
    promises: promises! {
        "20k" within "20,000", at most 20_000.0: "5, 10 and 20 mm, 10 mm in or crossing, and 4 %";
        "40k" within "40,000", at most 40_000.0: "0.4, 1 and 4 mm, 0.75 mm in or crossing, and 0.3 %";
        "60k" within "60,000", at most 60_000.0: "0.25, 0.4 and 2 mm, 0.3 mm in or crossing, and 0.1 %";
        "100k" within "100,000", at most 100_000.0: "0.25, 0.3 and 1 mm, 0.25 mm in or crossing, and 0.02 %";
    },
};

const fn none(id: &'static str, says: &'static str, unit: &'static str) -> Promise {
    Promise {
        id,
        says,
        criterion: TIMING,
        bound: Bound::Is(0.0),
        unit,
        limits: "Truth by whole queries, whose intervals must meet the tick's. Budgets measured to fit, and what `Cost::M7_TICK` buys. \
                 After 100 ticks, and after 100 from each leap, a motion of more than 1.5 mm in a tick. \
                 Left is what covers the dearest step, 40 tests, some 4,600 instructions.",
    }
}

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let [row, ..] = SHAFT;
    let scene = row.scene()?.context("a generated scene")?;
    let truth = truth(&scene);
    let second = &truth[truth.len() / 2..];
    let outside = second.iter().filter(|truth| truth.side != Side::Inside).count();
    ensure!(outside == 0, "{outside} of the short axes are not wholly inside the wall");
    let mut sums = Sums::default();
    sums.add(&SHAFT, &scene, &truth, figures)?;
    sums.note("shaft", figures);
    figures.note("shaft.ticks", scene.ticks() as f64);
    run(&scene, &truth, AMPLE).note_uncut("shaft", figures);
    Ok(Outcome::Passed)
}

//! A tracker's ticks within a budget: an instrument that hovers over a beating heart, touches it, passes through its
//! wall, lies along it and moves fast. Each tick's answer is compared with whole queries.

// Requirement: T-02

mod budgets;
mod path;
pub mod rows;
pub mod scene;
pub mod tally;

use anyhow::{Context, Result};
use rayon::prelude::*;
use xtask::steps::Outcome;

use self::rows::USUAL;
use self::scene::truth;
use self::tally::{Tally, run};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, note};
use crate::harness::{Check, Effort};

/// Ticks that a cold start may take.
const SETTLED: usize = 100;

/// A motion (mm) in one tick from which on the next tick counts as a cold start.
const LEAP: f32 = 1.5;

/// Separation (mm) at which a wall begins.
pub const MARGIN: f32 = 5.0;

/// The ticks since the last cold start.
#[derive(Default)]
pub struct Settling {
    ticks: usize,
}

impl Settling {
    /// Whether the cold start is over, for a tick after this motion (mm).
    pub fn is_settled(&mut self, moved: Option<f32>) -> bool {
        let is_leap = moved.is_none_or(|moved| moved > LEAP);
        self.ticks = if is_leap { 0 } else { self.ticks + 1 };
        self.ticks >= SETTLED
    }
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
            "instructions with {bounded.20k.tests} tests; the mean one {bounded.20k.mean}, the median of those that use the budget up {bounded.20k.spent}",
            20_000.0,
        ),
        note("bounded.20k.mean"),
        note("bounded.20k.tests"),
        note("bounded.20k.spent"),
        Promise {
            limits: SMALL,
            ..width(
                "bounded.40k.95",
                "With a budget of 40,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
                "mm; 99 %: {bounded.40k.99}, largest {bounded.40k.largest}; pair off the deepest and turned: {bounded.40k.turned} %",
                Bound::Informs,
            )
        },
        note("bounded.40k.99"),
        note("bounded.40k.largest"),
        note("bounded.40k.turned"),
        largest(
            "bounded.40k.instructions",
            "On the board the largest of these ticks takes",
            "instructions with {bounded.40k.tests} tests; the mean one {bounded.40k.mean}, the median of those that use the budget up {bounded.40k.spent}",
            40_000.0,
        ),
        note("bounded.40k.mean"),
        note("bounded.40k.tests"),
        note("bounded.40k.spent"),
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
            "instructions with {bounded.60k.tests} tests; the mean one {bounded.60k.mean}, the median of those that use the budget up {bounded.60k.spent}",
            60_000.0,
        ),
        note("bounded.60k.mean"),
        note("bounded.60k.tests"),
        note("bounded.60k.spent"),
        width(
            "bounded.100k.95",
            "With a budget of 100,000 instructions, measured, a tick: the interval's width at 95 % of the ticks near the wall",
            "mm; 99 %: {bounded.100k.99}, largest {bounded.100k.largest}; pair off the deepest and turned: {bounded.100k.turned} %",
            Bound::AtMost(0.25),
        ),
        note("bounded.100k.99"),
        note("bounded.100k.largest"),
        note("bounded.100k.turned"),
        largest(
            "bounded.100k.instructions",
            "On the board the largest of these ticks takes",
            "instructions with {bounded.100k.tests} tests; the mean one {bounded.100k.mean}, the median of those that use the budget up {bounded.100k.spent}",
            100_000.0,
        ),
        note("bounded.100k.mean"),
        note("bounded.100k.tests"),
        note("bounded.100k.spent"),
    ],
};

/// How the small budgets were chosen, and what did not narrow their intervals.
const SMALL: &str = "The budget is the largest whose dearest tick was measured within the instructions; the median tick that uses it up \
     takes {bounded.40k.spent}, because a test's price is its mean cost. Four designs did not narrow the interval: an unfinished \
     search among the leaves as its lower end, a certain depth of the last deepest point from its leaves, half of the \
     budget for dividing the axis, and no look at a point while another search waits.";

/// The width of the interval within a budget.
pub const fn width(
    id: &'static str,
    says: &'static str,
    unit: &'static str,
    bound: Bound,
) -> Promise {
    Promise { id, says, criterion: TIMING, bound, unit, limits: "" }
}

/// The largest tick of a row on the board.
pub const fn largest(
    id: &'static str,
    says: &'static str,
    unit: &'static str,
    most: f64,
) -> Promise {
    let limits =
        "The same path, the surface interpolated. Emulated Cortex-M7; instructions, not cycles.";
    Promise { id, says, criterion: TIMING, bound: Bound::AtMost(most), unit, limits }
}

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let [row, ..] = USUAL;
    let scene = row.scene()?.context("a generated scene")?;
    let truth = truth(&scene);
    let tallies = USUAL.par_iter().map(|row| Ok(run(&scene, &truth, row.budget()?)));
    let tallies: Vec<Tally> = tallies.collect::<Result<_>>()?;
    let sum = |of: fn(&Tally) -> usize| tallies.iter().map(of).sum::<usize>() as f64;
    figures.note("bounded.ticks", scene.ticks() as f64);
    figures.note("bounded.wrong", sum(|tally| tally.wrong));
    figures.note("bounded.damped", sum(|tally| tally.damped));
    figures.note("bounded.near", sum(|tally| tally.widths.len()));
    for (tally, row) in tallies.iter().zip(&USUAL) {
        tally.note(row.name, figures);
        row.note_board(&scene, &tally.work, figures)?;
    }
    Ok(Outcome::Passed)
}

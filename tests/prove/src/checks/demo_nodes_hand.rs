//! The demo with a simulated hand, on a heart of 50,000 triangles that a lattice's nodes move: the budgets end searches.

// Requirements: C-03, C-05, F-07, P-03

use anyhow::Result;
use xtask::steps::Outcome;

use super::demo::{Run, keep, report_of};
use super::demo_hand;
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{EDGES, FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "a hand on the emulated board, with nodes",
    run: check,
    promises: &[
        note("demo.nodes.hand.ticks"),
        note("demo.nodes.hand.instants"),
        Promise {
            id: "demo.nodes.hand.commanded",
            says: "Into a heart of 50,000 triangles that 720 nodes carry the hand does not get by commands, either",
            criterion: EDGES,
            bound: Bound::AtMost(0.02),
            unit: "mm of penetration at the deepest, at {demo.nodes.hand.instants} instants or on the surface that was searched; \
                   {demo.nodes.hand.commanded.least} mm from the heart at the least",
            limits: "As above. The guard's answer and the filter have 200,000 instructions each, which a search often takes: the \
                     filter then shortens the motion.",
        },
        note("demo.nodes.hand.commanded.least"),
        Promise {
            id: "demo.nodes.hand.near",
            says: "No motion admitted then comes nearer than the stand-off, unless the filter says so",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {demo.nodes.hand.commanded.ticks} ticks, less 0.02 mm and the accuracy; without a safe motion were \
                   {demo.nodes.hand.unsafe}, shortened {demo.nodes.hand.shortened}",
            limits: "A new frame may be nearer than the extrapolation before it.",
        },
        note("demo.nodes.hand.commanded.ticks"),
        note("demo.nodes.hand.unsafe"),
        note("demo.nodes.hand.shortened"),
        Promise {
            id: "demo.nodes.hand.pushed",
            says: "Against the wall's force its axis does not get in there",
            criterion: FLOW,
            bound: Bound::AtMost(1.0),
            unit: "mm of penetration at the deepest; {demo.nodes.hand.pushed.least} mm from the heart at the least",
            limits: "As above.",
        },
        note("demo.nodes.hand.pushed.least"),
        Promise {
            id: "demo.nodes.hand.given",
            says: "The wall that nodes move gives the hand no more energy than its account",
            criterion: FLOW,
            bound: Bound::AtMost(1.0),
            unit: "mJ at any time, beyond what the hand gave",
            limits: "As above.",
        },
        Promise {
            id: "demo.nodes.hand.step",
            says: "Its force changes by at most 0.5 N from one tick to the next",
            criterion: FLOW,
            bound: Bound::AtMost(0.5),
            unit: "N",
            limits: "New frames among them.",
        },
        note("demo.nodes.hand.filter.mean"),
        Promise {
            id: "demo.nodes.hand.filter.largest",
            says: "Longest filtered tick on the board then: the closest pair, the trust and the filter",
            criterion: TIMING,
            bound: Bound::AtMost(450_000.0),
            unit: "instructions; {demo.nodes.hand.filter.mean} in the mean",
            limits: "One capsule, one run.",
        },
        Promise {
            id: "demo.nodes.hand.misses",
            says: "No control tick with the hand is missed or late then",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.nodes.hand.ticks} ticks at 1 kHz",
            limits: "500 million instructions a second, one a cycle.",
        },
        Promise {
            id: "demo.nodes.hand.mismatches",
            says: "Every answer for the hand agrees with exhaustive search in f64 then",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "answers",
            limits: "",
        },
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let run = Run { seconds: effort.demo_seconds, hand: true, nodes: true, ..Run::default() };
    let report = report_of(run)?;
    demo_hand::note_figures("demo.nodes.hand", &report, figures)?;
    let shortened = report["reasons"]["shortened"].as_f64().unwrap_or(0.0);
    figures.note("demo.nodes.hand.shortened", shortened);
    keep(effort, "demo-nodes-hand", "nodes-hand")?;
    Ok(Outcome::Passed)
}

//! The demo with a simulated hand that pushes the instrument against the beating heart, and does not penetrate it.

// Requirements: C-03, C-04, C-05, P-03

use anyhow::Result;
use serde_json::{Value, json};
use xtask::steps::Outcome;

use super::demo::{Run, keep, number, report_of};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{EDGES, FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "a hand on the emulated board",
    run: check,
    promises: &[
        note("demo.hand.ticks"),
        note("demo.hand.instants"),
        Promise {
            id: "demo.hand.commanded",
            says: "A simulated hand does not get in by commands, which a filter admits on the board",
            criterion: EDGES,
            bound: Bound::AtMost(0.02),
            unit: "mm of penetration at the deepest, into the heart itself at {demo.hand.instants} instants or into the surface \
                   that was searched; {demo.hand.commanded.least} mm from the heart at the least",
            limits: "The generated heart beats in real time; frames come over Ethernet. The hand commands up to 225 mm/s towards its \
                     middle from all sides above; stand-off 0.5 mm. From a push's first safe motion on. Truth by exhaustive search \
                     in f64.",
        },
        note("demo.hand.commanded.least"),
        Promise {
            id: "demo.hand.near",
            says: "No admitted motion comes nearer than the stand-off on the surface of the next tick, unless the filter says so",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {demo.hand.commanded.ticks} ticks, less 0.02 mm and the accuracy; without a safe motion were {demo.hand.unsafe}",
            limits: "A new frame may be nearer than the extrapolation before it.",
        },
        note("demo.hand.commanded.ticks"),
        note("demo.hand.unsafe"),
        Promise {
            id: "demo.hand.pushed",
            says: "Against the wall's force its axis does not get in, either",
            criterion: FLOW,
            bound: Bound::AtMost(1.0),
            unit: "mm of penetration at the deepest; {demo.hand.pushed.least} mm from the heart at the least",
            limits: "Pushed with 4.5 N of the wall's 5, for 0.7 s from each side; 1 N/mm, margin 5 mm, radius 2.5 mm. A heart's wall that \
                     comes faster than 25 mm/s is not left fast enough by what remains of 5 N.",
        },
        note("demo.hand.pushed.least"),
        Promise {
            id: "demo.hand.given",
            says: "The moving wall gives the hand no more energy than its account",
            criterion: FLOW,
            bound: Bound::AtMost(1.0),
            unit: "mJ at any time, beyond what the hand gave",
            limits: "Its tank has 1 mJ. Beyond it come at most 8.25 mJ, where a force of 5 N falls by 0.5 N a tick at 300 mm/s: not here.",
        },
        Promise {
            id: "demo.hand.step",
            says: "The force changes by at most 0.5 N from one tick to the next",
            criterion: FLOW,
            bound: Bound::AtMost(0.5),
            unit: "N",
            limits: "New frames among them.",
        },
        Promise {
            id: "demo.hand.filter.mean",
            says: "A filtered tick on the board: the closest pair, the trust and the filter",
            criterion: TIMING,
            bound: Bound::AtMost(100_000.0),
            unit: "instructions in the mean; {demo.hand.filter.largest} at most",
            limits: "One capsule. The largest of one run.",
        },
        note("demo.hand.filter.largest"),
        Promise {
            id: "demo.hand.misses",
            says: "No control tick is missed or late then",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.hand.ticks} ticks at 1 kHz",
            limits: "500 million instructions a second, one a cycle.",
        },
        Promise {
            id: "demo.hand.mismatches",
            says: "Every answer then agrees with exhaustive search in f64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "answers",
            limits: "",
        },
    ],
};

/// Records the figures of the demo's report.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let report = report_of(Run { seconds: effort.demo_seconds, hand: true, ..Run::default() })?;
    note_figures("demo.hand", &report, figures)?;
    keep(effort, "demo-hand", "hand")?;
    Ok(Outcome::Passed)
}

/// Records the figures of a hand's report, under names that begin with `of`.
pub fn note_figures(of: &str, report: &Value, figures: &mut Figures) -> Result<()> {
    let (pushed, commanded) = (&report["by_force"], &report["by_commands"]);
    let mean = number(&commanded["answer_instructions_mean"], "mean")?.round();
    let unsafe_ticks = json!(report["reasons"]["no safe motion"].as_f64().unwrap_or(0.0));
    for (name, value) in [
        ("ticks", &report["ticks"]),
        ("misses", &report["deadline_misses"]),
        ("mismatches", &report["mismatches"]),
        ("commanded", &commanded["penetration_max_mm"]),
        ("commanded.least", &commanded["heart_separation_min_mm"]),
        ("commanded.ticks", &commanded["ticks"]),
        ("instants", &commanded["heart_instants"]),
        ("near", &report["admitted_too_near"]),
        ("pushed", &pushed["penetration_max_mm"]),
        ("pushed.least", &pushed["heart_separation_min_mm"]),
        ("given", &report["energy_given_max_mj"]),
        ("step", &report["push_force_step_max_n"]),
        ("filter.mean", &json!(mean)),
        ("filter.largest", &commanded["answer_instructions_max"]),
        ("unsafe", &unsafe_ticks),
    ] {
        figures.note(&format!("{of}.{name}"), (number(value, name)? * 1e3).round() / 1e3);
    }
    Ok(())
}

//! The demo with faults on the bus, which also stops for a while.

// Requirements: B-01, C-01, P-03

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::steps::Outcome;

use super::demo::{Run, keep, number, report_of};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FAULTS, FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo with faults on the bus",
    run: check,
    promises: &[
        note("demo.faults.ticks"),
        note("demo.faults.answers"),
        note("demo.faults.injected"),
        note("demo.faults.compared"),
        note("demo.faults.rejected"),
        Promise {
            id: "demo.faults.misses",
            says: "No control tick at 1 kHz is missed or late with faults on a busy bus",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.faults.ticks} ticks, {demo.faults.injected} faults among the packets",
            limits: "As for the demo without faults. `cargo xtask demo --faults` draws them from a seed.",
        },
        Promise {
            id: "demo.faults.wrong",
            says: "Nothing is published then that was not sent",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {demo.faults.compared} frames read back; {demo.faults.rejected} packets and frames rejected",
            limits: "",
        },
        Promise {
            id: "demo.faults.mismatches",
            says: "Every answer then agrees with exhaustive search in f64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.faults.answers} answers in {demo.faults.ticks} ticks",
            limits: "",
        },
        note("demo.faults.safe-after-frame"),
        note("demo.faults.recovered-after"),
        Promise {
            id: "demo.faults.safe-after-packet",
            says: "A bus that falls silent makes the output safe in time",
            criterion: FAULTS,
            // The limit of `Trust::ETHERNET`, plus the tick that detects it.
            bound: Bound::AtMost(81.0),
            unit: "ms after the last good packet, {demo.faults.safe-after-frame} ms after the last good frame; \
         nominal again {demo.faults.recovered-after} ms later",
            limits: "The example's limit, for a bus of 60 frames a second.",
        },
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let report = report_of(Run { seconds: effort.fault_seconds, faults: true, ..Run::default() })?;
    for (name, field) in [
        ("demo.faults.ticks", "ticks"),
        ("demo.faults.answers", "queries"),
        ("demo.faults.misses", "deadline_misses"),
        ("demo.faults.mismatches", "mismatches"),
        ("demo.faults.compared", "frames_compared"),
        ("demo.faults.wrong", "frames_published_wrong"),
        ("demo.faults.rejected", "frames_rejected"),
    ] {
        figures.note(name, number(&report[field], field)?);
    }
    let injected = report["faults"]["injected"].as_object().context("no faults in the report")?;
    let injected: u64 = injected.values().filter_map(Value::as_u64).sum();
    figures.note("demo.faults.injected", injected as f64);
    for (name, field) in [
        ("demo.faults.safe-after-packet", "since_packet"),
        ("demo.faults.safe-after-frame", "since_frame"),
        ("demo.faults.recovered-after", "recovered_after"),
    ] {
        figures.note(name, number(&report["silence"][field], field)?);
    }
    keep(effort, "demo-faults", "faults")?;
    Ok(Outcome::Passed)
}

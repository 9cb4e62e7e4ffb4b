//! The demo with the controller in C, on the emulated board.

// Requirement: P-06

use anyhow::Result;
use xtask::c_firmware;
use xtask::steps::Outcome;

use super::demo::{Run, folder, number, report_of, written};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo in C on the emulated board",
    run: check,
    promises: &[
        note("demo.c.ticks"),
        note("demo.c.answers"),
        note("demo.c.compared"),
        Promise {
            id: "demo.c.misses",
            says: "The controller in C misses no control tick at 1 kHz either",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.c.ticks} ticks on the emulated board",
            limits: "As for the controller in Rust. `cargo xtask demo --c` runs it.",
        },
        Promise {
            id: "demo.c.mismatches",
            says: "Every answer of the C interface agrees with exhaustive search in f64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.c.answers} answers in {demo.c.ticks} ticks",
            limits: "",
        },
        Promise {
            id: "demo.c.wrong",
            says: "Every frame that the controller in C published is, to the bit, one that was sent",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.c.compared} frames read back",
            limits: "CRC-32.",
        },
    ],
};

/// Duration of a test run, in seconds of the controller's time. A frame takes one second, but that time does not wait
/// for a busy host to send, so a run without a frame is repeated, twice as long.
const SHORT: u32 = 2;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    // Its compiler is only in Debian, so not every machine has it.
    if let Err(error) = c_firmware::find() {
        return Ok(Outcome::Skipped(format!("{error:#}")));
    }
    let run = |seconds| report_of(Run { seconds, c: true, ..Run::default() });
    let shortest = if effort.is_record { effort.demo_seconds } else { SHORT };
    let mut report = run(shortest);
    for seconds in [2 * shortest, 4 * shortest] {
        if report.is_ok() || !is_without_frames() {
            break;
        }
        println!("no frame came in time on a busy computer: again, for {seconds} s");
        report = run(seconds);
    }
    let report = report?;
    for (name, field) in [
        ("demo.c.ticks", "ticks"),
        ("demo.c.answers", "queries"),
        ("demo.c.compared", "frames_compared"),
        ("demo.c.misses", "deadline_misses"),
        ("demo.c.mismatches", "mismatches"),
        ("demo.c.wrong", "frames_published_wrong"),
    ] {
        figures.note(name, number(&report[field], field)?);
    }
    Ok(Outcome::Passed)
}

/// Whether the last run published nothing.
fn is_without_frames() -> bool {
    written(&folder("demo-c")).is_ok_and(|report| report["frames_published"] == 0)
}

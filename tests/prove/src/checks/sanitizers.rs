//! Frames, bus and corrupt trees under the sanitizers of the nightly compiler.

// Requirement: P-04

use anyhow::Result;
use xtask::nightly::{self, Sanitized};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, MEMORY},
    note,
};
use crate::harness::{Check, Effort};

pub const ADDRESS: Check = Check {
    name: "address sanitizer",
    run: address,
    promises: &[
        note("sanitizer.address.tests"),
        Promise {
            id: "sanitizer.address",
            says: "Frames, bus and corrupt trees under the address sanitizer",
            criterion: MEMORY,
            bound: Bound::Is(0.0),
            unit: "findings in {sanitizer.address.tests} tests",
            limits: "Nightly compiler; skipped without one. Miri: `cargo xtask miri`, where it is installed.",
        },
    ],
};

pub const THREAD: Check = Check {
    name: "thread sanitizer",
    run: thread,
    promises: &[
        note("sanitizer.thread.tests"),
        Promise {
            id: "sanitizer.thread",
            says: "Frames and bus under the thread sanitizer",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "findings in {sanitizer.thread.tests} tests",
            limits: "As above. What looks like a race in the test harness itself is left out \
         (`tests/soundness/tsan.txt` says why); a race put in on purpose is found.",
        },
    ],
};

fn address(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    check("address", figures)
}

fn thread(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    check("thread", figures)
}

fn check(sanitizer: &str, figures: &mut Figures) -> Result<Outcome> {
    if let Some(reason) = nightly::missing() {
        return Ok(Outcome::Skipped(reason));
    }
    let Sanitized { tests, findings } = nightly::sanitize(sanitizer)?;
    figures.note(&format!("sanitizer.{sanitizer}"), findings as f64);
    figures.note(&format!("sanitizer.{sanitizer}.tests"), tests as f64);
    Ok(Outcome::Passed)
}

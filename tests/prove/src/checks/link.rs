//! The firmware links, so it has no panic path; and it has no allocator.

// Requirement: P-01

use anyhow::{Context, Result, ensure};
use xtask::firmware::{self, Surface};
use xtask::steps::Outcome;

use crate::footprint::Footprint;
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FAULTS, RESOURCES},
};
use crate::harness::{Check, Effort};
use crate::probe::board;

pub const CHECK: Check = Check {
    name: "firmware without panic and allocator",
    run: check,
    promises: &[
        Promise {
            id: "panics",
            says: "The firmware links, and so has no panic path; one put in on purpose breaks the link",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "panic paths",
            limits: "The release build. Debug builds stop instead.",
        },
        Promise {
            id: "allocators",
            says: "No allocator in the firmware",
            criterion: RESOURCES,
            bound: Bound::Is(0.0),
            unit: "allocator symbols",
            limits: "",
        },
    ],
};

/// A planted panic path must break the link, which proves that the link is a check.
fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let (cross, surface) = (board()?, Surface::default());
    let footprint = Footprint::read(&firmware::build(&cross, &surface)?)?;
    figures.note("allocators", footprint.allocators.len() as f64);
    figures.note("panics", footprint.panics.len() as f64);
    let found = [&footprint.allocators[..], &footprint.panics].concat().join(", ");
    ensure!(found.is_empty(), "the firmware has {found}");

    let mut planted = firmware::command(&cross, &surface);
    let build = planted.args(["--features", "planted-panic"]).output()?;
    let said = String::from_utf8_lossy(&build.stderr);
    ensure!(!build.status.success(), "a planted panic path did not break the link");
    ensure!(said.contains("a_panic_path_survived"), "it broke something else:\n{said}");

    for (feature, what) in [("batched", "batched queries have"), ("filter", "a filter has")] {
        let mut other = firmware::command(&cross, &surface);
        xtask::process::run(other.args(["--features", feature]))
            .with_context(|| format!("{what} a panic path"))?;
    }
    Ok(Outcome::Passed)
}

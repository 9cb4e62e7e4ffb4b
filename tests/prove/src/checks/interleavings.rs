//! All interleavings of a writer's and a reader's steps, by loom.

// Requirement: F-01

use anyhow::Result;
use xtask::nightly;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "every interleaving of the frames",
    run: check,
    promises: &[Promise {
        id: "frames.interleavings",
        says: "No frame is torn or lost, in any order of a writer's and a reader's steps",
        criterion: FLOW,
        bound: Bound::AtLeast(100.0),
        unit: "orders, all of them that three frames and three reads have",
        limits: "loom's memory model, which lets no load see a later store.",
    }],
};

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    figures.note("frames.interleavings", nightly::interleavings()? as f64);
    Ok(Outcome::Passed)
}

//! The frames under Miri, where it is installed.

// Requirements: F-01, P-04

use anyhow::Result;
use xtask::nightly;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check { name: "miri", run: check, promises: &[] };

fn check(_: &Effort, _: &mut Figures) -> Result<Outcome> {
    match nightly::miri_missing() {
        Some(reason) => Ok(Outcome::Skipped(reason)),
        None => nightly::miri().map(|()| Outcome::Passed),
    }
}

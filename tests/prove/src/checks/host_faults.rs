//! The fault matrix on this computer.

// Requirement: B-01

use anyhow::{Context, Result};
use xtask::steps::Outcome;
use xtask::workspace;

use crate::faults::{self, Machine, Record};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FAULTS, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "faults on this computer",
    run: check,
    promises: &[
        note("faults.kinds"),
        note("faults.injected"),
        note("faults.recovered-within"),
        Promise {
            id: "faults.wrong",
            says: "Of the faults of the matrix below none is published",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {faults.injected} faults of {faults.kinds} kinds",
            limits: "One fault at a time on a small surface, in virtual time. What no receiver can detect is listed \
                     below.",
        },
        Promise {
            id: "faults.not-recovered",
            says: "After each of them the receiver publishes again",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "did not; {faults.recovered-within} undisturbed frames at most until it did",
            limits: "",
        },
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let record = Record::measure(effort.faults, Machine::Here, effort.is_record, effort.size())?;
    tell(&record, "faults", "faults.json", effort, figures)
}

/// Records the figures of a matrix, and writes its record.
pub fn tell(
    record: &Record,
    prefix: &str,
    file: &str,
    effort: &Effort,
    figures: &mut Figures,
) -> Result<Outcome> {
    let rows = &record.matrix;
    let sum = |of: fn(&faults::Row) -> u64| rows.iter().map(of).sum::<u64>() as f64;
    let most = rows.iter().map(|row| row.recovered_frames_max).max().unwrap_or(0);
    let mut note = |name: &str, value: f64| figures.note(&format!("{prefix}.{name}"), value);
    note("kinds", rows.len() as f64);
    note("injected", sum(|row| row.injected));
    note("wrong", sum(|row| row.published_wrong));
    note("not-recovered", sum(|row| row.not_recovered));
    note("recovered-within", f64::from(most));
    if effort.is_record {
        let file = workspace::evidence().join(file);
        record.write(&file).with_context(|| format!("cannot write {}", file.display()))?;
    }
    record.verdict().map(|()| Outcome::Passed)
}

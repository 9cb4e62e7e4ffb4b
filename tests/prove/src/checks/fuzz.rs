//! The fuzz targets, if there is a nightly compiler.

// Requirements: M-03, P-04

use anyhow::{Result, ensure};
use xtask::nightly::{self, FuzzOptions, Fuzzed};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::EDGES, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "fuzzers",
    run: check,
    promises: &[
        note("fuzz.seconds"),
        note("fuzz.tree.inputs"),
        note("fuzz.packets.inputs"),
        note("fuzz.poses.inputs"),
        note("fuzz.mesh.inputs"),
        note("fuzz.query.inputs"),
        Promise {
            id: "fuzz.findings",
            says: "No input makes the readers of trees, packets and meshes, or a query, panic or hang",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "findings in {fuzz.tree.inputs} trees, {fuzz.packets.inputs} rows of packets, {fuzz.poses.inputs} of \
         packets with poses, {fuzz.mesh.inputs} mesh files and {fuzz.query.inputs} queries, {fuzz.seconds} s each",
            limits: "Nightly compiler; skipped without one.",
        },
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    if let Some(reason) = nightly::missing() {
        return Ok(Outcome::Skipped(reason));
    }
    let fuzzed = nightly::fuzz(&FuzzOptions { seconds: effort.fuzz_seconds, target: None })?;
    for Fuzzed { target, inputs, .. } in &fuzzed {
        figures.note(&format!("fuzz.{target}.inputs"), *inputs as f64);
    }
    let findings: Vec<String> = fuzzed.into_iter().filter_map(|f| f.finding).collect();
    figures.note("fuzz.seconds", f64::from(effort.fuzz_seconds));
    figures.note("fuzz.findings", findings.len() as f64);
    ensure!(findings.is_empty(), "{}", findings.join("\n"));
    Ok(Outcome::Passed)
}

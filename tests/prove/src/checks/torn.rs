//! Frames that are published during queries, on the emulated board.

// Requirement: F-01

use anyhow::{Result, ensure};
use dibs_build::{Builder, IndexWidth};
use dibs_tests::surfaces;
use xtask::qemu;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW, note};
use crate::harness::{Check, Effort};
use crate::probe::{board, build_for_board, run_on_board};

pub const CHECK: Check = Check {
    name: "torn reads on the board",
    run: check,
    promises: &[
        note("torn.queries"),
        note("torn.published"),
        note("torn.put-off"),
        note("torn.mixed-without"),
        Promise {
            id: "torn.mixed",
            says: "No query sees vertices of two frames, published in its midst",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {torn.queries} queries on the emulated board while {torn.published} frames were published and \
         {torn.put-off} put off; without the protocol {torn.mixed-without} queries do",
            limits: "",
        },
    ],
};

/// Runs queries under interrupts that publish frames.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "torn")?;
    let counts = run_on_board(&program, &script(effort.torn)?, qemu::BOARD)?;
    note_counts("torn", &counts, figures)?;
    Ok(Outcome::Passed)
}

/// The program's script.
pub fn script(queries: u32) -> Result<Vec<u8>> {
    let built = Builder::new().index(IndexWidth::Bits16).build(&surfaces::ball(3))?;
    let mut script = queries.to_le_bytes().to_vec();
    script.extend((built.blob().len() as u32).to_le_bytes());
    script.extend(built.blob());
    Ok(script)
}

/// Notes what the program counted.
pub fn note_counts(of: &str, counts: &[u32], figures: &mut Figures) -> Result<()> {
    ensure!(counts.len() == 5, "{} counts, not 5", counts.len());
    let names = ["queries", "mixed", "published", "put-off", "mixed-without"];
    for (name, count) in names.into_iter().zip(counts) {
        figures.note(&format!("{of}.{name}"), f64::from(*count));
    }
    // Without the protocol the check must detect torn reads.
    ensure!(counts[4] > 0, "no query saw two epochs even without the protocol");
    Ok(())
}

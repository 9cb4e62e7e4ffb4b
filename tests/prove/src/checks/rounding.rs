//! The rounding of the smallest kernels, by Gappa.

// Requirement: A-01

use anyhow::{Result, ensure};
use dibs_rounding::kernels::{Stated, goals};
use dibs_rounding::{gappa, planted};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::EDGES, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "rounding of the smallest kernels",
    run: check,
    promises: &[
        Promise {
            id: "rounding.refused",
            says: "Errors of a node's bound, a plane's comparison and an embedded vertex are at most as the core states",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {rounding.goals} goals refused by Gappa; of {rounding.planted} wrong constants, {rounding.found} are",
            limits: "Real numbers times 1 + delta, plus what underflows, as Flocq has it of binary32. Spheres as tools. `cargo xtask \
                     rounding` also checks the proofs by Coq.",
        },
        note("rounding.goals"),
        note("rounding.planted"),
        note("rounding.found"),
    ],
};

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    if let Err(error) = gappa::find() {
        return Ok(Outcome::Skipped(format!("{error:#}")));
    }
    let goals = goals(&Stated::shipped());
    let mut refused = 0;
    for (goal, tape) in &goals {
        if let Some(said) = gappa::refusal(&goal.script(tape))? {
            eprintln!("{}: {said}", goal.name);
            refused += 1;
        }
    }
    let planted = planted()?;
    let found = planted.iter().filter(|(_, is_refused)| *is_refused).count();
    ensure!(found == planted.len(), "proven, but wrong: {planted:?}");
    for (name, count) in
        [("refused", refused), ("goals", goals.len()), ("planted", planted.len()), ("found", found)]
    {
        figures.note(&format!("rounding.{name}"), count as f64);
    }
    Ok(Outcome::Passed)
}

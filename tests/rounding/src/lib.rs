//! Machine-checked rounding of the smallest kernels.
//!
//! `build.rs` takes the kernels' functions from the shipped sources. Here they are compiled with a recording scalar
//! ([`tape`]) in place of `f32`, and run once for each path through their comparisons. Each path becomes goals for Gappa
//! ([`goal`]): an expression, in the recorded operations, that must not be negative. Coq checks Gappa's certificates.
//!
//! # What is assumed of a rounding
//!
//! Let `u = 2^-24`. Binary32, to nearest, ties to even, no operation overflows, no fused multiply-add (the core has none).
//! Then a sum or a difference of two numbers is the exact one times `1 + delta`; a product or a square root is the exact
//! one times `1 + delta`, plus `eta`; with `|delta| <= u / (1 + u)` and `|eta| <= 2^-150`, half of the least
//! number. `model.v` has these as theorems, by Flocq. So nothing is assumed about underflow but what a
//! goal's own head says: a length that is divided by, or a root's argument, is not below the length that kernels take
//! for zero.
//!
//! # To add a kernel
//!
//! Add its functions to `build.rs`, stand-ins for what they call to [`shipped`], and a file to [`kernels`].

// Requirement: A-01

mod coq;
pub mod gappa;
mod goal;
pub mod kernels;
mod report;
mod shipped;
mod tape;
mod term;
mod vector;

use anyhow::Result;
use goal::{Goal, U};
use kernels::Stated;
pub use report::report;
use tape::Tape;

/// Constants as shipped.
#[allow(dead_code)]
mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

/// Each constant, what is stated, and what Gappa proves of it, in units of `u`: the sum of the least shares of its goals,
/// to a hundredth.
///
/// # Errors
/// If Gappa cannot be run.
pub fn provable(goals: &[(Goal, Tape)]) -> Result<Vec<(&'static str, f64, f64)>> {
    let mut found: Vec<(&str, f64, f64)> = Vec::new();
    for (constant, stated) in kernels::stated() {
        let mut most = 0.0_f64;
        for (goal, tape) in goals {
            let of = (0..goal.shares.len()).filter(|&at| goal.shares[at].constant == constant);
            let least = of.map(|at| least(goal, tape, at)).sum::<Result<f64>>()?;
            most = most.max(least);
        }
        found.push((constant, stated, most));
    }
    Ok(found)
}

/// The least share, in hundredths of `u`, with which a goal is still proven.
fn least(goal: &Goal, tape: &Tape, at: usize) -> Result<f64> {
    let is_proven = |hundredths: u32| {
        let mut goal = goal.clone();
        goal.shares[at].times = f64::from(hundredths) / 100.0;
        gappa::refusal(&goal.script(tape)).map(|refusal| refusal.is_none())
    };
    let (mut low, mut high) = (0, (goal.shares[at].times * 100.0).round() as u32);
    while high - low > 1 {
        let middle = low.midpoint(high);
        if is_proven(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(f64::from(high) / 100.0 * goal.shares[at].room)
}

/// Wrong constants, and whether Gappa refuses one of their goals.
///
/// # Errors
/// If Gappa cannot be run.
pub fn planted() -> Result<Vec<(&'static str, bool)>> {
    let stated = Stated::shipped();
    let wrong = [
        ("4 u for BOUND", Stated { bound: 4.0 * U, ..stated }),
        ("7 u for PLANE", Stated { plane: 7.0 * U, ..stated }),
        ("8 u for COORDINATES", Stated { coordinates: 8.0 * U, ..stated }),
        ("2.99 u for DOT", Stated { dot: 2.99 * U, ..stated }),
        ("three vertices in a blend's bound", Stated { vertices: 3.0, ..stated }),
    ];
    let refused = wrong.map(|(what, stated)| {
        let goals = kernels::goals(&stated);
        let is_refused = goals.iter().try_fold(false, |is_refused, (goal, tape)| {
            Ok(is_refused || gappa::refusal(&goal.script(tape))?.is_some())
        });
        is_refused.map(|is_refused| (what, is_refused))
    });
    refused.into_iter().collect()
}

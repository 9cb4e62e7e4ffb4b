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

use anyhow::{Context, Result};
use goal::{Goal, U};
use kernels::Stated;
pub use report::report;
use tape::Tape;

/// Constants as shipped.
mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

/// Each constant, what is stated, and what Gappa proves, in units of `u`: the sum of the largest coefficients of its parts.
///
/// # Errors
/// If Gappa cannot be run.
pub fn provable(goals: &[(Goal, Tape)]) -> Result<Vec<(&'static str, f64, f64)>> {
    let mut found: Vec<_> = kernels::stated().map(|(name, stated)| (name, stated, 0.0)).into();
    for (goal, tape) in goals {
        let shares = gappa::least(goal, tape)?;
        for (constant, _, most) in &mut found {
            let of =
                goal.shares.iter().zip(&shares).filter(|(share, _)| share.constant == *constant);
            let least: f64 = of.map(|(share, least)| least / U * share.room).sum();
            *most = least.max(*most);
        }
    }
    Ok(found)
}

/// Wrong constants, and whether Gappa refuses their goal.
///
/// # Errors
/// If Gappa cannot be run.
pub fn planted() -> Result<Vec<(&'static str, bool)>> {
    let stated = Stated::shipped();
    let wrong = [
        ("4 u for BOUND", "node_pushed", Stated { bound: 4.0 * U, ..stated }),
        ("7 u for PLANE", "plane_beyond", Stated { plane: 7.0 * U, ..stated }),
        ("8 u for COORDINATES", "plane_beyond", Stated { coordinates: 8.0 * U, ..stated }),
        ("2.99 u for DOT", "dot_low", Stated { dot: 2.99 * U, ..stated }),
        ("three vertices in a blend's bound", "blend_x_low", Stated { vertices: 3.0, ..stated }),
    ];
    let refused = wrong.map(|(what, name, stated)| {
        let goals = kernels::goals(&stated);
        let goal = goals.iter().find(|(goal, _)| goal.name == name);
        let (goal, tape) = goal.with_context(|| format!("no {name}"))?;
        Ok((what, gappa::refusal(&goal.script(tape))?.is_some()))
    });
    refused.into_iter().collect()
}

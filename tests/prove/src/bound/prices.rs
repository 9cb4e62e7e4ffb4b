//! The prices of the facts, by a linear program with lazily generated constraints: each time the check finds a longer
//! walk, or a cycle with a gain, it is added. The solver is not trusted: the last check is exact.

use anyhow::{Result, anyhow, bail};
use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};

use super::facts::Most;
use super::graph::Program;
use super::system::System;
use super::walk::{Longest, UNIT, Walk, longest};

/// Most rounds.
const ROUNDS: usize = 2_000;
/// Loss, in instructions or cycles, that each cycle must have, so that rounding the prices does not turn it into a gain.
const LOSS: f64 = 0.01;
/// Instructions or cycles by which the longest walk may exceed the solver's result.
const NEAR: f64 = 0.5;

/// A bound that was checked.
pub struct Bound {
    /// The price of each fact, in units of 1 / [`UNIT`].
    pub prices: Vec<i128>,
    /// The longest walk at these prices, and its gain.
    pub walk: Walk,
    pub gain: i128,
    /// Number of iterations.
    pub rounds: usize,
}

impl Bound {
    /// The constants: instructions or cycles of every query, of each further root, of each node test and of each triangle test,
    /// in units of 1 / [`UNIT`].
    pub fn constants(&self, system: &System) -> [i128; 4] {
        let mut sum = [self.gain, 0, 0, 0];
        for (row, price) in system.rows.iter().zip(&self.prices) {
            for (sum, most) in sum.iter_mut().zip(row.most.each()) {
                *sum += price * i128::from(most);
            }
        }
        sum
    }
}

/// Finds the prices that minimise the bound for a query with these counts, and checks them. `weigh` is that of [`longest`].
/// A loop that no fact bounds is an error, which describes its place.
pub fn least(
    program: &Program,
    system: &System,
    of: &Most,
    weigh: &dyn Fn(u32) -> i64,
    describe: impl Fn(u32) -> String,
) -> Result<Bound> {
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let free = (0.0, f64::INFINITY);
    let weights = of.each().map(|count| count as f64);
    let prices: Vec<_> = system
        .rows
        .iter()
        .map(|row| {
            let each = row.most.each().into_iter().zip(weights);
            problem.add_var(each.map(|(most, weight)| most as f64 * weight).sum(), free)
        })
        .collect();
    let whole = problem.add_var(1.0, free);
    for round in 1..=ROUNDS {
        let SolveOutcome::Solution(solution) = problem.solve()? else { bail!("no prices in time") };
        let now: Vec<i128> =
            prices.iter().map(|&price| (solution[price] * UNIT as f64).round() as i128).collect();
        let found = longest(program, system, &now, weigh)?;
        let mut add = |walk: &Walk, is_cycle: bool| {
            let counts = walk.counts.iter().filter(|(_, count)| **count != 0);
            let mut terms: Vec<_> =
                counts.map(|(&fact, &count)| (prices[fact], count as f64)).collect();
            if !is_cycle {
                terms.push((whole, 1.0));
            }
            let least = walk.length as f64 + if is_cycle { LOSS } else { 0.0 };
            if terms.iter().all(|(_, count)| *count <= 0.0) {
                return Err(anyhow!("no fact bounds the loop through {}", describe(walk.through)));
            }
            problem.add_constraint(terms, ComparisonOp::Ge, least);
            Ok(())
        };
        match found {
            Longest::Cycles(cycles) => {
                for cycle in &cycles {
                    add(cycle, true)?;
                }
            }
            Longest::Walk(walk, gain) => {
                if gain as f64 / UNIT as f64 <= solution[whole] + NEAR {
                    return Ok(Bound { prices: now, walk, gain, rounds: round });
                }
                add(&walk, false)?;
            }
        }
    }
    bail!("no prices after {ROUNDS} rounds")
}

//! A query's instructions on the board: the paper's moving tool around a beating heart, and adversarial poses.

// Requirements: A-01, E-01

use anyhow::Result;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::script::{Asks, Record, Script, Start};
use crate::probe::{Answers, board, build_for_board, on_board};

pub const CHECK: Check = Check {
    name: "queries on the board",
    run: check,
    promises: &[
        golden("m7.warm.mean"),
        Promise {
            id: "m7.warm.largest",
            says: "The largest query on table 3's path: every tick on another surface, warm start, measured stretch",
            criterion: TIMING,
            bound: Bound::AtMost(160_000.0),
            unit: "instructions; {m7.warm.mean} in the mean of {m7.warm.queries} ticks, 99 % below {m7.warm.99}, \
         {m7.warm.node-tests} node and {m7.warm.triangle-tests} triangle tests",
            limits: "The generated heart of 10,272 triangles, a capsule, limit 1.5, emulated Cortex-M7. \
         Instructions, not cycles: 160,000 are a third of a millisecond at 480 MHz and \
                     one instruction a cycle.",
        },
        note("m7.warm.99"),
        note("m7.warm.queries"),
        note("m7.warm.node-tests"),
        note("m7.warm.triangle-tests"),
        Promise {
            id: "m7.cold.mean",
            says: "The mean query on the same path, cold and with the limit on stretch alone",
            criterion: TIMING,
            bound: Bound::AtMost(60_000.0),
            unit: "instructions in the mean of {m7.cold.queries} ticks; 99 % below {m7.cold.99}, at most \
         {m7.cold.largest}; {m7.cold.node-tests} node and {m7.cold.triangle-tests} triangle tests",
            limits: "As above.",
        },
        note("m7.cold.99"),
        note("m7.cold.largest"),
        note("m7.cold.queries"),
        note("m7.cold.node-tests"),
        note("m7.cold.triangle-tests"),
        Promise {
            id: "m7.poses.largest",
            says: "The largest query on the same heart, cold: adversarial capsules on, in, through and far from the surface",
            criterion: TIMING,
            bound: Bound::AtMost(160_000.0),
            unit: "instructions; {m7.poses.mean} in the mean of {m7.poses.queries} poses, 99 % below \
         {m7.poses.99}; {m7.poses.node-tests} node and {m7.poses.triangle-tests} triangle tests",
            limits: "With measured stretch. Random poses of kinds chosen to hurt, not a proof of the worst: that is \
         what a budget is for.",
        },
        note("m7.poses.mean"),
        note("m7.poses.99"),
        note("m7.poses.queries"),
        note("m7.poses.node-tests"),
        note("m7.poses.triangle-tests"),
    ],
};

/// Records the instructions of queries on the generated heart (table 3's path and limit, another surface at every
/// tick), warm with measured stretch and cold with only the limit, and of adversarial poses.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "probe")?;
    let ask = |script: Script| on_board(&program, &script, true);
    for (name, start) in [("warm", Start::Warm), ("cold", Start::Cold)] {
        tell(name, &ask(Script::beating(effort.ticks, start, Asks::Distance))?, figures);
    }
    tell("poses", &ask(Script::poses(effort.poses, Asks::Distance, 41))?, figures);
    Ok(Outcome::Passed)
}

fn tell(name: &str, answers: &Answers, figures: &mut Figures) {
    let mut taken = Vec::new();
    let mut tests = [0.0; 2];
    for answer in answers.iter() {
        if matches!(answer.record, Record::Query { is_capsule: true, .. }) {
            taken.push(answer.instructions);
            for (sum, tests) in tests.iter_mut().zip(answer.tests()) {
                *sum += f64::from(tests);
            }
        }
    }
    taken.sort_unstable();
    let count = taken.len() as f64;
    let mean = taken.iter().map(|&one| f64::from(one)).sum::<f64>() / count;
    let at = |share: f64| f64::from(taken[((count - 1.0) * share) as usize]);
    figures.note(&format!("m7.{name}.mean"), mean.round());
    figures.note(&format!("m7.{name}.99"), at(0.99));
    figures.note(&format!("m7.{name}.largest"), at(1.0));
    figures.note(&format!("m7.{name}.queries"), count);
    for (kind, sum) in ["node", "triangle"].into_iter().zip(tests) {
        figures.note(&format!("m7.{name}.{kind}-tests"), (sum / count * 10.0).round() / 10.0);
    }
}

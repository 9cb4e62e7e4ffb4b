//! What a query takes on the board: the paper's moving tool about a beating heart, and poses that hurt.

use anyhow::Result;

use super::Effort;
use super::figures::Figures;
use super::probe::{Answers, build_for_board, on_board};
use super::script::{Knows, Record, Script};
use crate::toolchain::Cross;

/// Notes the instructions of queries on the generated heart (table 3's path and limit, every tick's
/// surface another), warm with measured stretch and cold with the limit alone, and of poses.
pub fn check(cross: &Cross, effort: &Effort, figures: &mut Figures) -> Result<()> {
    let program = build_for_board(cross, "probe")?;
    let ask = |script: Script| on_board(&program, &script, true);
    for (name, knows) in [("warm", Knows::Everything), ("cold", Knows::Nothing)] {
        note(name, &ask(Script::beating(effort.ticks, knows))?, figures);
    }
    note("poses", &ask(Script::poses(effort.poses, 41))?, figures);
    Ok(())
}

fn note(name: &str, answers: &Answers, figures: &mut Figures) {
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

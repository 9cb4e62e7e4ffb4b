//! Modal surfaces on the board: the same bits as on the host, and the instructions of a vertex, a bound and a query.

// Requirement: F-06

use anyhow::{Result, ensure};
use xtask::steps::Outcome;

use super::bits::differences;
use crate::harness::figures::Figures;
use crate::harness::promise::golden;
use crate::harness::{Check, Effort};
use crate::probe::script::{Record, Script};
use crate::probe::{Answers, Build, board, build_for_board, on_board};

pub const CHECK: Check = Check {
    name: "modal surfaces on the board",
    run: check,
    promises: &[
        golden("modes.8.vertex"),
        golden("modes.8.bound"),
        golden("modes.8.query.rows"),
        golden("modes.8.query.rows.largest"),
        golden("modes.8.query.weights"),
        golden("modes.8.query.weights.largest"),
        golden("modes.8.query.remembered"),
        golden("modes.8.query.remembered.largest"),
        golden("modes.16.vertex"),
        golden("modes.16.bound"),
        golden("modes.16.query.rows"),
        golden("modes.16.query.rows.largest"),
        golden("modes.16.query.weights"),
        golden("modes.16.query.weights.largest"),
        golden("modes.16.query.remembered"),
        golden("modes.16.query.remembered.largest"),
    ],
};

/// Numbers of modes that are measured.
const MODES: [usize; 2] = [8, 16];

/// Queries of each frame.
const QUERIES: usize = 40;

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "probe")?;
    for modes in MODES {
        let script = Script::modal(modes, QUERIES, 41);
        let answers = on_board(&program, &script, true)?;
        let ours = Build::Release.answers(&script)?;
        ensure!(differences(&ours, &answers, "modal surfaces on the M7") == 0, "other bits");
        ensure!(agree(&answers), "a modal surface and its rows gave different answers");
        let note = |figures: &mut Figures, name: &str, value: f64| {
            figures.note(&format!("modes.{modes}.{name}"), value.round());
        };
        let mut vertices = Vec::new();
        let mut bounds = Vec::new();
        let mut queries: [Vec<f64>; 3] = Default::default();
        let mut table = 0;
        for answer in answers.iter() {
            let instructions = f64::from(answer.instructions);
            match answer.record {
                Record::Stretch(_) => table = 0,
                Record::Bound => {
                    bounds.push(instructions);
                    table = if table == 1 { 2 } else { 1 };
                }
                Record::Positions(count) => vertices.push(instructions / f64::from(count)),
                Record::Query { .. } => queries[table].push(instructions),
            }
        }
        note(figures, "vertex", mean(&vertices));
        note(figures, "bound", mean(&bounds));
        for (name, queries) in ["rows", "weights", "remembered"].iter().zip(&queries) {
            note(figures, &format!("query.{name}"), mean(queries));
            let most = queries.iter().copied().fold(0.0, f64::max);
            note(figures, &format!("query.{name}.largest"), most);
        }
    }
    Ok(Outcome::Passed)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Whether each query of a frame found the same separation with rows, weights and cached positions.
fn agree(answers: &Answers) -> bool {
    let separations: Vec<u32> = answers
        .iter()
        .filter(|answer| matches!(answer.record, Record::Query { .. }))
        .map(|answer| answer.words[3])
        .collect();
    separations.chunks(3 * QUERIES).all(|of_frame| {
        let (rows, modal) = of_frame.split_at(QUERIES);
        modal.chunks(QUERIES).all(|queries| queries == rows)
    })
}

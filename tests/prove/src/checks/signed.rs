//! Instructions of side, signed separation, depth and contacts on the board.

// Requirements: S-01, S-03, S-04

use anyhow::Result;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::script::{Asks, Record, Script, Start};
use crate::probe::{Answer, board, build_for_board, on_board};

pub const CHECK: Check = Check {
    name: "sides and contacts on the board",
    run: check,
    promises: &[
        Promise {
            id: "m7.signed.ratio",
            says: "Side and signed separation, of the cold query on table 3's path where the axis does not cross",
            criterion: TIMING,
            bound: Bound::AtMost(1.1),
            unit: "times the unsigned query's instructions: {m7.signed.mean} against {m7.signed.unsigned} in the mean of \
         {m7.signed.queries} ticks",
            limits: "The generated heart of 10,272 triangles, a capsule, limit 1.5, emulated Cortex-M7.",
        },
        note("m7.signed.mean"),
        note("m7.signed.unsigned"),
        note("m7.signed.queries"),
        Promise {
            id: "m7.crossing.mean",
            says: "The depth of an axis that crosses the surface, cold: the mean query",
            criterion: TIMING,
            bound: Bound::AtMost(150_000.0),
            unit: "instructions in the mean of {m7.crossing.queries} poses that cross",
            limits: "The same heart, adversarial capsules, measured stretch.",
        },
        Promise {
            id: "m7.crossing.largest",
            says: "The same, the largest query",
            criterion: TIMING,
            bound: Bound::AtMost(400_000.0),
            unit: "instructions; 99 % below {m7.crossing.99}",
            limits: "Of those poses, not a proof of the worst: that is what a budget is for.",
        },
        note("m7.crossing.queries"),
        note("m7.crossing.99"),
        golden("m7.crossing.sample.mean"),
        golden("m7.crossing.sample.largest"),
        Promise {
            id: "m7.contacts.mean",
            says: "All contacts within 5 mm, cold, on table 3's path",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions in the mean of {m7.contacts.queries} ticks, at most {m7.contacts.largest}",
            limits: "The same heart and capsule; the closest pair is in it.",
        },
        note("m7.contacts.queries"),
        note("m7.contacts.largest"),
    ],
};

/// Number of poses of the golden figures: the same at every effort, so that each run can be compared with the record.
const SAMPLE: usize = 1_000;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "probe")?;
    let taken = |script: Script, is_asked: fn(&Answer<'_>) -> bool| -> Result<Vec<f64>> {
        let answers = on_board(&program, &script, true)?;
        let queries = answers.iter().filter(|answer| matches!(answer.record, Record::Query { .. }));
        let asked = queries.filter(|answer| is_asked(answer));
        let mut taken: Vec<f64> = asked.map(|answer| f64::from(answer.instructions)).collect();
        taken.sort_unstable_by(f64::total_cmp);
        Ok(taken)
    };
    let path = |asks| Script::beating(effort.ticks, Start::Cold, asks);
    let mean = |taken: &[f64]| (taken.iter().sum::<f64>() / taken.len() as f64).round();
    let unsigned = taken(path(Asks::Distance), |answer| !crosses(answer))?;
    let signed = taken(path(Asks::Side), |answer| !crosses(answer))?;
    figures.note("m7.signed.unsigned", mean(&unsigned));
    figures.note("m7.signed.mean", mean(&signed));
    figures.note("m7.signed.queries", signed.len() as f64);
    figures.note("m7.signed.ratio", (mean(&signed) / mean(&unsigned) * 1e3).round() / 1e3);
    let poses = |number| taken(Script::poses(number, Asks::Side, 41), crosses);
    let sample = poses(SAMPLE)?;
    figures.note("m7.crossing.sample.mean", mean(&sample));
    figures.note("m7.crossing.sample.largest", sample[sample.len() - 1]);
    let crossing = if effort.poses == SAMPLE { sample } else { poses(effort.poses)? };
    figures.note("m7.crossing.mean", mean(&crossing));
    figures.note("m7.crossing.queries", crossing.len() as f64);
    figures.note("m7.crossing.99", crossing[(crossing.len() - 1) * 99 / 100]);
    figures.note("m7.crossing.largest", crossing[crossing.len() - 1]);
    let contacts = taken(path(Asks::Contacts), |_| true)?;
    figures.note("m7.contacts.mean", mean(&contacts));
    figures.note("m7.contacts.queries", contacts.len() as f64);
    figures.note("m7.contacts.largest", contacts[contacts.len() - 1]);
    Ok(Outcome::Passed)
}

/// Whether the axis meets the surface, to the stated accuracy.
fn crosses(answer: &Answer<'_>) -> bool {
    let [accuracy, distance] = [answer.words[5], answer.words[6]].map(f32::from_bits);
    distance <= accuracy
}

//! The same bits from every compiler option and processor.

// Requirement: A-11

use anyhow::Result;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW, note};
use crate::harness::{Check, Effort};
use crate::probe::script::{Draw, Script};
use crate::probe::{Answers, Build, board, build_for_board, on_board};

pub const CHECK: Check = Check {
    name: "the same bits everywhere",
    run: check,
    promises: &[
        note("bits.queries"),
        note("bits.hash"),
        Promise {
            id: "bits.different",
            says: "The same bits on the Cortex-M7 and on x86-64 in debug, release and native builds",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {bits.queries} answers (separation, points, triangle, counts); their hash is {bits.hash}",
            limits: "An emulated processor; compilers as installed.",
        },
    ],
};

/// Answers one script in every build, and compares all bits of all answers.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let script = Script::adversarial(effort.bits, Draw::EitherWay, 1);
    let release = Build::Release.answers(&script)?;
    figures.note("bits.queries", script.queries() as f64);
    figures.text("bits.hash", format!("{:016x}", hash(&release)));
    let mut different = 0;
    for build in [Build::Debug, Build::Native] {
        different += differences(&release, &build.answers(&script)?, build.name());
    }
    let program = build_for_board(&board()?, "probe")?;
    let on_board = on_board(&program, &script, false)?;
    different += differences(&release, &on_board, "the emulated Cortex-M7");
    figures.note("bits.different", different as f64);
    Ok(Outcome::Passed)
}

/// Number of answers that differ in any bit.
pub fn differences(ours: &Answers, theirs: &Answers, name: &str) -> usize {
    let pairs = ours.iter().zip(theirs.iter()).enumerate();
    let different: Vec<usize> = pairs
        .filter(|(_, (ours, theirs))| ours.bits() != theirs.bits())
        .map(|(number, _)| number)
        .collect();
    match different.first() {
        Some(first) => println!("{name}: {} answers differ, first {first}", different.len()),
        None => println!("{name}: the same bits"),
    }
    different.len()
}

/// FNV-1a over all bits of all answers, for a comparison by eye.
fn hash(answers: &Answers) -> u64 {
    let bytes = answers.iter().flat_map(|answer| {
        answer.bits().iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>()
    });
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    })
}

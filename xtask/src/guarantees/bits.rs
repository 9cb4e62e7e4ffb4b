//! The same bits, whatever compiled the queries and whatever runs them.

use anyhow::{Result, ensure};

use super::figures::Figures;
use super::probe::{Answers, Build, build_for_board, on_board};
use super::script::{Draw, Script};
use crate::toolchain::Cross;

/// Answers one script everywhere, and compares all bits of all answers.
pub fn check(cross: &Cross, queries: usize, figures: &mut Figures) -> Result<()> {
    let script = Script::adversarial(queries, Draw::Any, 1);
    let release = Build::Release.answers(&script)?;
    figures.note("bits.queries", script.queries() as f64);
    figures.text("bits.hash", format!("{:016x}", hash(&release)));
    for build in [Build::Debug, Build::Native] {
        compare(&release, &build.answers(&script)?, build.name())?;
    }
    let program = build_for_board(cross, "probe")?;
    compare(&release, &on_board(&program, &script, false)?, "the emulated Cortex-M7")?;
    figures.note("bits.different", 0.0);
    Ok(())
}

pub fn compare(ours: &Answers, theirs: &Answers, name: &str) -> Result<()> {
    let different: Vec<usize> = ours
        .iter()
        .zip(theirs.iter())
        .enumerate()
        .filter(|(_, (ours, theirs))| ours.bits() != theirs.bits())
        .map(|(number, _)| number)
        .collect();
    let first = different.first().copied().unwrap_or_default();
    ensure!(
        different.is_empty(),
        "{} answers differ on {name}, the first: {first}",
        different.len()
    );
    println!("{name}: the same bits");
    Ok(())
}

/// FNV-1a over all bits of all answers: a name for them, to compare by eye.
fn hash(answers: &Answers) -> u64 {
    let bytes = answers.iter().flat_map(|answer| {
        answer.bits().iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>()
    });
    bytes.fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    })
}

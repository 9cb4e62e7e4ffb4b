//! Frames published in the middle of queries, on the emulated board.

use std::fs;
use std::path::Path;

use anyhow::{Result, ensure};
use dibs_build::{Builder, IndexWidth};
use dibs_tests::surfaces;

use super::figures::Figures;
use super::probe::{build_for_board, run_on_board};
use crate::qemu;
use crate::toolchain::Cross;

/// Runs `queries` queries under interrupts that publish frames.
pub fn check(cross: &Cross, queries: u32, figures: &mut Figures) -> Result<()> {
    let program = build_for_board(cross, "torn")?;
    let built = Builder::new().index(IndexWidth::Bits16).build(&surfaces::ball(3))?;
    let mut script = queries.to_le_bytes().to_vec();
    script.extend((built.blob().len() as u32).to_le_bytes());
    script.extend(built.blob());
    let counts = run_on_board(&program, &script, qemu::BOARD, |answers: &Path| {
        let bytes = fs::read(answers)?;
        let words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        Ok(words.collect::<Vec<_>>())
    })?;
    ensure!(counts.len() == 5, "{} counts, not 5", counts.len());
    let names = ["queries", "mixed", "published", "put-off", "mixed-without"];
    for (name, count) in names.into_iter().zip(&counts) {
        figures.note(&format!("torn.{name}"), f64::from(*count));
    }
    ensure!(counts[1] == 0, "{} queries saw vertices of two epochs", counts[1]);
    // So that the check is known to see it.
    ensure!(counts[4] > 0, "no query saw two epochs even without the protocol");
    Ok(())
}

//! The fault matrix on the emulated board.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use super::Effort;
use super::figures::Figures;
use super::probe::build_for_board;
use crate::process::run;
use crate::toolchain::Cross;
use crate::workspace;

/// Sends this many faults of each kind to the board through its UART.
pub fn check(cross: &Cross, per_fault: u32, figures: &mut Figures) -> Result<()> {
    let program = build_for_board(cross, "bus")?;
    // What a run of the tests finds is no record.
    let is_record = per_fault >= Effort::FULL.board_faults;
    let folder = if is_record { "docs" } else { "target/guarantees" };
    let folder = workspace::root().join(folder);
    fs::create_dir_all(&folder)?;
    let file = folder.join("faults-board.json");
    let mut cargo = Command::new("cargo");
    cargo.args(["bench", "--quiet", "--package", "dibs-tests", "--bench", "faults", "--"]);
    cargo.args(["--per-fault", &per_fault.to_string(), "--board"]).arg(&program);
    // It ends with an error where anything was published wrong or not recovered from.
    run(cargo.arg("--write").arg(&file).current_dir(workspace::root()))?;
    let record: Value = serde_json::from_str(&fs::read_to_string(&file)?)?;
    let rows = record["matrix"].as_array().context("no matrix")?;
    let sum = |field: &str| rows.iter().filter_map(|row| row[field].as_u64()).sum::<u64>() as f64;
    let most = rows.iter().filter_map(|row| row["recovered_frames_max"].as_u64()).max();
    figures.note("board.faults.kinds", rows.len() as f64);
    figures.note("board.faults.injected", sum("injected"));
    figures.note("board.faults.wrong", sum("published_wrong"));
    figures.note("board.faults.not-recovered", sum("not_recovered"));
    figures.note("board.faults.recovered-within", most.unwrap_or(0) as f64);
    Ok(())
}

//! The fault matrix in docs/evidence/guarantees.md: for the host from docs/evidence/faults.json, for the board from
//! docs/evidence/faults-board.json, which have the same rows.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

use anyhow::{Context, Result};
use serde::Deserialize;
use xtask::workspace;

use super::markdown::grouped;
use super::run::Run;

/// A record of `crate::faults`; the board's contains only the matrix.
#[derive(Deserialize)]
struct Faults {
    /// Missing in older records.
    run: Option<Run>,
    matrix: Vec<Kind>,
    #[serde(default)]
    undetectable: Vec<String>,
    #[serde(default)]
    corruption: Vec<Corruption>,
    #[serde(default)]
    sizes: Vec<Size>,
}

/// One kind of fault.
#[derive(Deserialize)]
struct Kind {
    fault: String,
    injected: u64,
    detected: u64,
    harmless: u64,
    published_wrong: u64,
    rejected: BTreeMap<String, u64>,
    recovered_frames_mean: f64,
    recovered_frames_max: u32,
    not_recovered: u64,
}

/// A line that damages packets.
#[derive(Deserialize)]
struct Corruption {
    frames: String,
    packets_damaged: f64,
    throughput: f64,
    age_mean_ms: f64,
    age_p99_ms: f64,
    age_max_ms: f64,
    published_wrong: u64,
}

/// A heart, sent in one way.
#[derive(Deserialize)]
struct Size {
    heart: String,
    vertices: u64,
    frames: String,
    rate: f64,
    bytes_per_frame: f64,
    packets_per_frame: f64,
    error_mm: f64,
}

/// The chapter; empty if there is no record.
pub fn render() -> Result<String> {
    let mut out = String::new();
    if let Some(host) = read("faults.json")? {
        out.push_str(include_str!("texts/faults.md"));
        of(&mut out, host.run.as_ref())?;
        matrix(&mut out, &host.matrix)?;
        out.push_str("\nNot detected, whatever a receiver does:\n\n");
        for what in &host.undetectable {
            writeln!(out, "- {what}")?;
        }
        corruption(&mut out, &host.corruption)?;
        sizes(&mut out, &host.sizes)?;
        out.push('\n');
    }
    if let Some(board) = read("faults-board.json")? {
        out.push_str("## Faults on the emulated board, through its UART\n");
        of(&mut out, board.run.as_ref())?;
        matrix(&mut out, &board.matrix)?;
        out.push('\n');
    }
    Ok(out)
}

/// Writes which run a chapter is from.
fn of(out: &mut String, run: Option<&Run>) -> Result<()> {
    match run {
        Some(Run { date, commit, machine, size, .. }) => {
            writeln!(
                out,
                "\nMeasured at commit `{commit}`, {date}, size `{size}`, on {machine}.\n"
            )?;
        }
        None => writeln!(out, "\nThe record does not say of which commit it is.\n")?,
    }
    Ok(())
}

fn read(name: &str) -> Result<Option<Faults>> {
    let file = workspace::evidence().join(name);
    if !file.is_file() {
        return Ok(None);
    }
    let faults = serde_json::from_str(&fs::read_to_string(&file)?);
    faults.map(Some).with_context(|| format!("{} is no record of faults", file.display()))
}

fn matrix(out: &mut String, kinds: &[Kind]) -> Result<()> {
    out.push_str(
        "| fault | injected | detected | harmless | published wrong | recovered within, frames: mean, most | \
         not recovered | most often counted as |\n|---|---:|---:|---:|---:|---:|---:|---|\n",
    );
    for kind in kinds {
        let mut causes: Vec<(&String, u64)> =
            kind.rejected.iter().map(|(cause, &count)| (cause, count)).collect();
        causes.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let causes: Vec<&str> = causes.iter().take(3).map(|(cause, _)| cause.as_str()).collect();
        writeln!(
            out,
            "| {} | {} | {} | {} | {} | {:.2}, {} | {} | {} |",
            kind.fault,
            grouped(kind.injected),
            grouped(kind.detected),
            grouped(kind.harmless),
            kind.published_wrong,
            kind.recovered_frames_mean,
            kind.recovered_frames_max,
            kind.not_recovered,
            causes.join(", ")
        )?;
    }
    Ok(())
}

fn corruption(out: &mut String, rows: &[Corruption]) -> Result<()> {
    out.push_str(include_str!("texts/corruption.md"));
    out.push_str(
        "\n| frames | packets damaged | published a second | age in ms: mean | 99 % below | most | \
         published wrong |\n|---|---:|---:|---:|---:|---:|---:|\n",
    );
    for row in rows {
        writeln!(
            out,
            "| {} | {:.1} % | {:.1} | {:.0} | {:.0} | {:.0} | {} |",
            row.frames,
            row.packets_damaged * 100.0,
            row.throughput,
            row.age_mean_ms,
            row.age_p99_ms,
            row.age_max_ms,
            row.published_wrong
        )?;
    }
    Ok(())
}

fn sizes(out: &mut String, rows: &[Size]) -> Result<()> {
    out.push_str(include_str!("texts/sizes.md"));
    out.push_str(
        "\n| heart | vertices | frames | at Hz | bytes a frame | packets | error, mm |\n\
         |---|---:|---|---:|---:|---:|---:|\n",
    );
    for row in rows {
        writeln!(
            out,
            "| {} | {} | {} | {:.0} | {} | {:.1} | {:.4} |",
            row.heart,
            grouped(row.vertices),
            row.frames,
            row.rate,
            grouped(row.bytes_per_frame.round() as u64),
            row.packets_per_frame,
            row.error_mm
        )?;
    }
    Ok(())
}

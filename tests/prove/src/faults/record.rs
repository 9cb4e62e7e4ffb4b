//! The record of a run, and its conditions.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use dibs_stream::faults::Fault;
use serde::Serialize;

use super::{Machine, Row, corruption, matrix, sizes};
use crate::harness::run::Run;

/// First of the seeds.
const SEED: u64 = 20_140_350;

/// The measurements of a run.
#[derive(Serialize)]
pub struct Record {
    pub run: Run,
    pub per_fault: u64,
    pub seed: u64,
    /// Faults that no receiver can detect.
    pub undetectable: [&'static str; 4],
    pub matrix: Vec<Row>,
    pub corruption: Vec<corruption::Row>,
    pub sizes: Vec<sizes::Row>,
}

/// Faults that no receiver can detect.
pub const UNDETECTABLE: [&str; 4] = [
    "damage after which the CRC-32 is right again: none of up to 32 neighbouring bits, one in 2^32 of \
     the rest; it must then pass the limits on coordinates and stretch too",
    "without a key: a sealed frame of plausible positions, from whoever can write to the bus",
    "without a key, or without a way back: frames of an earlier run of the sender, repeated to a \
     receiver that has just started and has published nothing",
    "a sender that is wrong itself, about positions within the limits",
];

impl Record {
    /// Runs the matrix with this many faults of each kind; on the host also frames on a bad line, and for a full record
    /// the sizes of frames.
    pub fn measure(
        per_fault: u64,
        place: Machine<'_>,
        everything: bool,
        size: String,
    ) -> Result<Self> {
        let matrix = matrix::run(per_fault, SEED, place)?;
        matrix.iter().for_each(|row| println!("{row}"));
        let (corruption, sizes) = match (place, everything) {
            (Machine::Board(_), _) => (Vec::new(), Vec::new()),
            (Machine::Here, true) => (corruption::run(SEED)?, sizes::run()?),
            (Machine::Here, false) => (corruption::smoke(SEED)?, Vec::new()),
        };
        corruption.iter().for_each(|row| println!("{row}"));
        sizes.iter().for_each(|row| println!("{row}"));
        let (undetectable, run) = (UNDETECTABLE, Run::now(size));
        Ok(Self { run, per_fault, seed: SEED, undetectable, matrix, corruption, sizes })
    }

    /// Fails if anything was published that was never sent, if a fault was not noticed, unless it is a harmless order of
    /// packets, or if the receiver did not recover.
    pub fn verdict(&self) -> Result<()> {
        let broken = self.broken();
        ensure!(broken.is_empty(), "broken promises:\n  {}", broken.join("\n  "));
        Ok(())
    }

    /// The promises that were broken.
    fn broken(&self) -> Vec<String> {
        let mut broken = Vec::new();
        for row in &self.matrix {
            if row.published_wrong > 0 {
                broken.push(format!("{}: {} published wrong", row.fault, row.published_wrong));
            }
            if row.not_recovered > 0 {
                broken.push(format!("{}: {} not recovered", row.fault, row.not_recovered));
            }
            // Packets in another order may make the same frame; of every other kind each fault must be noticed.
            let harmless = if row.fault == Fault::Reorder.name() { row.harmless } else { 0 };
            if row.detected + harmless != row.injected {
                broken.push(format!(
                    "{}: {} of {} were noticed",
                    row.fault, row.detected, row.injected
                ));
            }
        }
        for row in &self.corruption {
            if row.published_wrong > 0 {
                broken.push(format!(
                    "{} at {}: {} published wrong",
                    row.frames, row.packets_damaged, row.published_wrong
                ));
            }
        }
        broken
    }

    /// Writes the record, and the figure beside it.
    pub fn write(&self, path: &Path) -> Result<()> {
        let json = serde_json::to_string_pretty(self)? + "\n";
        let figures = path.parent().unwrap_or(Path::new(".")).join("figures");
        std::fs::create_dir_all(&figures)
            .with_context(|| format!("cannot make {}", figures.display()))?;
        let mut files = vec![(path.to_path_buf(), json)];
        // The board's record contains only the matrix.
        if !self.corruption.is_empty() {
            files.push((figures.join("faults.svg"), corruption::figure(&self.corruption)?));
        }
        for (path, text) in files {
            dibs_build::write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(())
    }
}

//! What is written, and what must hold.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use super::{corruption, matrix, sizes};

/// Everything that a run measured.
#[derive(Serialize)]
pub struct Record {
    pub per_fault: u64,
    pub seed: u64,
    pub matrix: Vec<matrix::Row>,
    pub corruption: Vec<corruption::Row>,
    pub sizes: Vec<sizes::Row>,
}

impl Record {
    /// The promises that were broken.
    pub fn broken(&self) -> Vec<String> {
        let mut broken = Vec::new();
        for row in &self.matrix {
            if row.published_wrong > 0 {
                broken.push(format!("{}: {} published wrong", row.fault, row.published_wrong));
            }
            if row.not_recovered > 0 {
                broken.push(format!("{}: {} not recovered", row.fault, row.not_recovered));
            }
            if row.detected + row.harmless != row.injected {
                broken.push(format!("{}: not every fault was noticed or harmless", row.fault));
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
        let figure = (figures.join("faults.svg"), corruption::figure(&self.corruption)?);
        for (path, text) in [(path.to_path_buf(), json), figure] {
            dibs_build::write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(())
    }
}

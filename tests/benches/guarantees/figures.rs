//! What the checks found, by name.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

/// Figures by name, and which of them must be 0.
#[derive(Default)]
pub struct Figures {
    values: BTreeMap<String, f64>,
    broken: Vec<String>,
}

impl Figures {
    /// A figure that only informs.
    pub fn note(&mut self, name: &str, value: f64) {
        println!("{name}: {value}");
        self.values.insert(name.to_owned(), value);
    }

    /// How often a promise was broken.
    pub fn never(&mut self, name: &str, count: u64) {
        self.note(name, count as f64);
        if count > 0 {
            self.broken.push(format!("{name}: {count}"));
        }
    }

    /// Writes them as JSON.
    pub fn write(&self, file: Option<&Path>) -> Result<()> {
        let Some(file) = file else { return Ok(()) };
        let text = serde_json::to_string_pretty(&self.values)?;
        std::fs::write(file, text + "\n")
            .with_context(|| format!("cannot write {}", file.display()))
    }

    /// An error that names every broken promise.
    pub fn verdict(&self) -> Result<()> {
        ensure!(self.broken.is_empty(), "broken: {}", self.broken.join(", "));
        Ok(())
    }
}

//! What the checks measured, by name.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

/// Figures by name: numbers, and a few texts.
#[derive(Default)]
pub struct Figures {
    measured: BTreeMap<String, Value>,
    /// Beginnings of the names of figures that cannot be measured here.
    skipped: Vec<String>,
}

impl Figures {
    /// A number.
    pub fn note(&mut self, name: &str, value: f64) {
        println!("{name}: {value}");
        self.measured.insert(name.to_owned(), Value::from(value));
    }

    /// A text.
    pub fn text(&mut self, name: &str, value: String) {
        println!("{name}: {value}");
        self.measured.insert(name.to_owned(), Value::from(value));
    }

    /// Takes over the figures that another program wrote as JSON.
    pub fn read(&mut self, file: &Path) -> Result<()> {
        let text = std::fs::read_to_string(file)
            .with_context(|| format!("no figures in {}", file.display()))?;
        let more: BTreeMap<String, Value> = serde_json::from_str(&text)?;
        self.measured.extend(more);
        Ok(())
    }

    /// What begins with this name cannot be measured here.
    pub fn skip(&mut self, beginning: &str) {
        self.skipped.push(beginning.to_owned());
    }

    /// Whether a figure cannot be measured here.
    pub fn is_skipped(&self, name: &str) -> bool {
        self.skipped.iter().any(|beginning| name.starts_with(beginning))
    }

    /// A figure, if it was measured.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.measured.get(name)
    }
}

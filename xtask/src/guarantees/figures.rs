//! What the checks measured, by name.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

/// Figures by name: numbers, and a few texts.
#[derive(Default)]
pub struct Figures(BTreeMap<String, Value>);

impl Figures {
    /// A number.
    pub fn note(&mut self, name: &str, value: f64) {
        println!("{name}: {value}");
        self.0.insert(name.to_owned(), Value::from(value));
    }

    /// A text.
    pub fn text(&mut self, name: &str, value: String) {
        println!("{name}: {value}");
        self.0.insert(name.to_owned(), Value::from(value));
    }

    /// Takes over the figures that another program wrote as JSON.
    pub fn read(&mut self, file: &Path) -> Result<()> {
        let text = std::fs::read_to_string(file)
            .with_context(|| format!("no figures in {}", file.display()))?;
        let more: BTreeMap<String, Value> = serde_json::from_str(&text)?;
        self.0.extend(more);
        Ok(())
    }

    /// A figure, if it was measured.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }
}

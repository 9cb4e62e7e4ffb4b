//! The measured figures, by name.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Figures by name: numbers, and a few texts.
#[derive(Default, Serialize, Deserialize)]
pub struct Figures {
    measured: BTreeMap<String, Value>,
}

impl Figures {
    /// Records a number.
    pub fn note(&mut self, name: &str, value: f64) {
        println!("{name}: {value}");
        self.measured.insert(name.to_owned(), Value::from(value));
    }

    /// Records a text.
    pub fn text(&mut self, name: &str, value: String) {
        println!("{name}: {value}");
        self.measured.insert(name.to_owned(), Value::from(value));
    }

    /// Adds another run's figures.
    pub fn append(&mut self, mut other: Self) {
        self.measured.append(&mut other.measured);
    }

    /// A figure, if it was measured.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.measured.get(name)
    }
}

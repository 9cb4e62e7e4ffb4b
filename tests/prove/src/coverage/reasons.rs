//! Why some places of the core are executed by no test, `.cargo/coverage.json`: by the text of the line, so that a reason
//! stays where its line moves, and goes where its line changes.

// Requirement: E-06

use std::fs;

use anyhow::{Context, Result};
use serde::Deserialize;
use xtask::workspace;

use super::record::Open;

#[derive(Deserialize)]
pub struct Reason {
    pub because: String,
    /// The end of a file's name below `dibs-nostd/src`, which may be empty, and a part of the line, or `fn` and the name of
    /// the function around it.
    pub places: Vec<[String; 2]>,
}

impl Reason {
    /// All reasons.
    pub fn read() -> Result<Vec<Self>> {
        let file = workspace::root().join(".cargo/coverage.json");
        let text =
            fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} has no reasons", file.display()))
    }

    /// Whether it is a place's reason.
    pub fn is_of(&self, open: &Open) -> bool {
        self.places.iter().any(|place| is_at(place, open))
    }

    /// Its places that the record does not have.
    pub fn stale<'a>(&'a self, open: &'a [Open]) -> impl Iterator<Item = &'a [String; 2]> {
        self.places.iter().filter(|place| !open.iter().any(|open| is_at(place, open)))
    }
}

fn is_at([file, text]: &[String; 2], open: &Open) -> bool {
    let is_around = text.strip_prefix("fn ").is_some_and(|name| name == open.function);
    open.file.ends_with(file.as_str()) && (is_around || open.line.contains(text.as_str()))
}

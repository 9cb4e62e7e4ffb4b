//! What stands in docs/guarantees.json: one record a promise.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::figures::Figures;
use super::markdown;
use super::promises::{Bound, PROMISES, Promise};
use crate::steps::Outcome;
use crate::workspace;

/// A promise, the figure that was measured for it, and what bounds it.
#[derive(Clone, Serialize, Deserialize, PartialEq)]
pub struct Record {
    pub id: String,
    pub promise: String,
    /// Criterion of IEC 62304, 5.5.4.
    pub criterion: String,
    /// The command that checks it.
    pub check: String,
    pub figure: Value,
    pub bound: String,
    pub unit: String,
    pub limits: String,
}

fn json() -> PathBuf {
    workspace::root().join("docs").join("guarantees.json")
}

fn committed() -> Result<Vec<Record>> {
    let file = json();
    let text = fs::read_to_string(&file)
        .with_context(|| format!("no {}: `cargo xtask guarantees` makes it", file.display()))?;
    Ok(serde_json::from_str(&text)?)
}

/// A committed number.
pub fn figure(id: &str) -> Result<f64> {
    let records = committed()?;
    let record = records.iter().find(|record| record.id == id);
    record
        .and_then(|record| record.figure.as_f64())
        .with_context(|| format!("no figure {id}: `cargo xtask guarantees` measures it"))
}

/// Writes both documents. A promise that was not measured keeps its record.
pub fn write(figures: &Figures) -> Result<()> {
    let before = committed().unwrap_or_default();
    let mut records = Vec::new();
    for promise in PROMISES {
        match figures.get(promise.id) {
            Some(figure) => records.push(promise.record(figure.clone())),
            None => records.extend(before.iter().find(|record| record.id == promise.id).cloned()),
        }
    }
    fs::write(json(), serde_json::to_string_pretty(&records)? + "\n")?;
    render()?;
    // Nothing is compared with what was committed before: these figures take its place.
    let broken: Vec<String> =
        PROMISES.iter().filter_map(|promise| promise.broken(figures, &[])).collect();
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}

/// Makes docs/guarantees.md of docs/guarantees.json.
pub fn render() -> Result<()> {
    let file = workspace::root().join("docs").join("guarantees.md");
    fs::write(file, markdown::render(&committed()?)?)?;
    Ok(())
}

/// Whether every promise was measured and is in the documents, every figure keeps its bound, none is worse
/// than the committed one by more than its tolerance, and the documents agree.
pub fn compare(figures: &Figures) -> Result<Outcome> {
    let before = committed()?;
    let mut broken: Vec<String> =
        PROMISES.iter().filter_map(|promise| promise.broken(figures, &before)).collect();
    let file = workspace::root().join("docs").join("guarantees.md");
    if fs::read_to_string(&file).unwrap_or_default() != markdown::render(&before)? {
        broken
            .push("docs/guarantees.md is not made from guarantees.json: run with --render".into());
    }
    for promise in PROMISES {
        if before.iter().all(|record| record.id != promise.id) {
            broken.push(format!("{} is not in docs/guarantees.json", promise.id));
        }
        if figures.get(promise.id).is_none() && !figures.is_skipped(promise.id) {
            broken.push(format!("{} was not measured", promise.id));
        }
    }
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(Outcome::Passed)
}

impl Promise {
    fn record(&self, figure: Value) -> Record {
        Record {
            id: self.id.to_owned(),
            promise: self.promise.to_owned(),
            criterion: self.criterion.to_owned(),
            check: self.check.to_owned(),
            figure,
            bound: self.bound.to_string(),
            unit: self.unit.to_owned(),
            limits: self.limits.to_owned(),
        }
    }

    /// What is wrong with this promise's figure, if it was measured.
    fn broken(&self, figures: &Figures, before: &[Record]) -> Option<String> {
        let id = self.id;
        let figure = figures.get(id)?;
        let Some(figure) = figure.as_f64() else {
            // A text, or what JSON makes of a number that is none.
            let is_bounded = !matches!(self.bound, Bound::Informs);
            return is_bounded.then(|| format!("{id} is {figure}, and must be {}", self.bound));
        };
        let kept = match self.bound {
            Bound::Informs => true,
            Bound::Is(value) => figure == value,
            Bound::AtMost(value) => figure <= value,
            Bound::AtLeast(value) => figure >= value,
            Bound::NotAbove(other) => {
                figures.get(other)?.as_f64().is_none_or(|most| figure <= most)
            }
            Bound::Golden(percent) => {
                let record = before.iter().find(|record| record.id == id)?;
                let golden = record.figure.as_f64()?;
                if figure > golden * (1.0 + percent / 100.0) {
                    return Some(format!("{id} is {figure}, {golden} is committed (+{percent} %)"));
                }
                if figure < golden * (1.0 - percent / 100.0) {
                    println!("{id} is {figure}, better than {golden}: `cargo xtask guarantees`");
                }
                true
            }
        };
        (!kept).then(|| format!("{id} is {figure}, and must be {}", self.bound))
    }
}

//! The records in docs/evidence/guarantees.json: one for each promise, with the run that measured it.

// Requirements: E-01, E-02

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use xtask::workspace;

use super::promise::{Bound, Promise, TOLERANCE};
use super::run::Run;
use super::{Check, Measured, markdown};
use crate::checks::CHECKS;

/// A promise, the figure that was measured for it, and its bound.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct Record {
    pub id: String,
    pub promise: String,
    /// Criterion of IEC 62304, 5.5.4.
    pub criterion: String,
    /// The check that measures it, as for `cargo xtask guarantees --only`.
    pub check: String,
    pub figure: Value,
    pub bound: String,
    pub unit: String,
    pub limits: String,
    /// For a golden figure, the lowest ever recorded, or the value that it was raised to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// Why the floor was raised, and from which figure.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub raised: String,
    pub run: Run,
    /// Of a search for what must not be found, an earlier one that was larger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub larger: Option<Search>,
}

/// A search at full size, which takes longer than the run of a release has.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct Search {
    pub figure: Value,
    /// With the figures of its run.
    pub unit: String,
    pub run: Run,
}

/// Prefixes of the names of golden figures that may be recorded above their floor, and the reason.
#[derive(Clone, Copy, Default)]
pub struct Raise<'a> {
    pub names: &'a [String],
    pub because: &'a str,
}

pub fn json() -> PathBuf {
    workspace::evidence().join("guarantees.json")
}

pub fn committed() -> Result<Vec<Record>> {
    read(&json())
}

fn read(file: &Path) -> Result<Vec<Record>> {
    let text = fs::read_to_string(file)
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

/// A committed text.
pub fn text(id: &str) -> Result<String> {
    let records = committed()?;
    let record = records.iter().find(|record| record.id == id);
    let text = record.and_then(|record| record.figure.as_str());
    text.map(str::to_owned).with_context(|| format!("no text {id}"))
}

/// Every promise, and its check, in the order of the document.
pub fn promises() -> impl Iterator<Item = (&'static Check, &'static Promise)> {
    CHECKS.iter().flat_map(|check| check.promises.iter().map(move |promise| (check, promise)))
}

/// Whether the records contain all figures of a check, each from a run of the same commit, size and machine.
pub fn has(records: &[Record], check: &Check, run: &Run) -> bool {
    let is_there = |promise: &Promise| {
        records.iter().any(|record| record.id == promise.id && record.run.is_of_the_same(run))
    };
    check.promises.iter().all(is_there)
}

/// Writes both documents. A promise that was not measured keeps its record; so does a golden figure above its floor
/// that was not raised, which is an error.
pub fn write(measured: &Measured, raise: Raise<'_>) -> Result<()> {
    let (records, broken) = merge(&committed().unwrap_or_default(), measured, raise);
    save(&records)?;
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}

/// Writes both documents, all of one run. The floors of golden figures are those of docs/evidence, wherever it writes.
///
/// # Errors
/// If a figure is missing or breaks its bound; nothing is written then.
pub fn write_whole(measured: &Measured, raise: Raise<'_>) -> Result<()> {
    let before = read(&workspace::root().join("docs/evidence/guarantees.json"))?;
    save(&whole(&before, measured, raise)?)
}

/// The records of a whole run. The error names the checks that are missing and the bounds that are broken.
pub fn whole(before: &[Record], measured: &Measured, raise: Raise<'_>) -> Result<Vec<Record>> {
    let (records, mut broken) = merge(before, measured, raise);
    let missing = promises().filter(|(_, promise)| measured.figures.get(promise.id).is_none());
    broken.extend(missing.map(|(check, promise)| format!("{}: no {}", check.name, promise.id)));
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(records)
}

/// The records after a run, and the promises that the run broke.
pub fn merge(
    before: &[Record],
    measured: &Measured,
    raise: Raise<'_>,
) -> (Vec<Record>, Vec<String>) {
    let (mut records, mut broken) = (Vec::new(), Vec::new());
    for (check, promise) in promises() {
        let old = before.iter().find(|record| record.id == promise.id);
        let Some(figure) = measured.figures.get(promise.id) else {
            records.extend(old.cloned());
            continue;
        };
        broken.extend(promise.broken(&measured.figures));
        let figure = figure.clone();
        let larger = old.and_then(|old| old.search(promise, before, &measured.run));
        match Record::new(check, promise, figure, &measured.run).above(old, raise) {
            Ok(record) => records.push(Record { larger, ..record }),
            Err(crept) => {
                broken.push(crept);
                records.extend(old.cloned());
            }
        }
    }
    (records, broken)
}

/// Makes docs/evidence/guarantees.md from docs/evidence/guarantees.json, without measuring. A record keeps the text
/// with which its figure was measured.
pub fn render() -> Result<()> {
    save(&committed()?)
}

fn save(records: &[Record]) -> Result<()> {
    let files = [
        (json(), serde_json::to_string_pretty(records)? + "\n"),
        (json().with_extension("md"), markdown::render(records)?),
    ];
    for (file, text) in files {
        dibs_build::write_atomically(&file, |out| out.write_all(text.as_bytes()))
            .with_context(|| format!("cannot write {}", file.display()))?;
    }
    Ok(())
}

/// Checks that every promise was measured and is in the documents, that no golden figure exceeds its floor by more than
/// its tolerance, and that the documents agree.
pub fn compare(measured: &Measured) -> Result<()> {
    let before = committed()?;
    let mut broken = Vec::new();
    if fs::read_to_string(json().with_extension("md")).unwrap_or_default()
        != markdown::render(&before)?
    {
        broken.push(
            "docs/evidence/guarantees.md is not made from guarantees.json: run `cargo xtask guarantees --render`"
                .into(),
        );
    }
    for (check, promise) in promises() {
        let (id, name) = (promise.id, check.name);
        let Some(record) = before.iter().find(|record| record.id == id) else {
            broken.push(format!(
                "{id} is not in docs/evidence/guarantees.json: record --only \"{name}\""
            ));
            continue;
        };
        match measured.figures.get(id) {
            Some(figure) => {
                let now = Record::new(check, promise, figure.clone(), &measured.run);
                broken.extend(now.above(Some(record), Raise::default()).err());
            }
            None if measured.skipped.contains(&name) => (),
            None => broken.push(format!("{id} was not measured")),
        }
    }
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}

impl Record {
    fn new(check: &Check, promise: &Promise, figure: Value, run: &Run) -> Self {
        Self {
            id: promise.id.to_owned(),
            promise: promise.says.to_owned(),
            criterion: promise.criterion.to_owned(),
            check: check.name.to_owned(),
            floor: figure.as_f64().filter(|_| matches!(promise.bound, Bound::Golden)),
            figure,
            bound: promise.bound.to_string(),
            unit: promise.unit.to_owned(),
            limits: promise.limits.to_owned(),
            raised: String::new(),
            run: run.clone(),
            larger: None,
        }
    }

    /// The search at full size that a run of another size keeps: this one, or what this one kept.
    fn search(&self, promise: &Promise, records: &[Self], next: &Run) -> Option<Search> {
        if !matches!(promise.bound, Bound::Is(0.0)) || next.size == "full" {
            return None;
        }
        if !self.run.is_full() {
            return self.larger.clone();
        }
        let unit = markdown::with_figures(&self.unit, records);
        Some(Search { figure: self.figure.clone(), unit, run: self.run.clone() })
    }

    /// The record with the floor of the previous one; an error states by how much it is exceeded.
    fn above(mut self, before: Option<&Self>, raise: Raise<'_>) -> Result<Self, String> {
        let (Some(now), Some(before)) = (self.floor, before) else { return Ok(self) };
        let Some(floor) = before.floor.or(before.figure.as_f64()) else { return Ok(self) };
        let id = &self.id;
        if now > floor * (1.0 + TOLERANCE / 100.0) {
            let is_raised = raise.names.iter().any(|name| id.starts_with(name.as_str()));
            if !is_raised {
                return Err(format!(
                    "{id} is {now}, more than {TOLERANCE} % above {floor}, the lowest recorded: \
                     `--raise {id} --because REASON` records it"
                ));
            }
            self.raised = format!("raised from {floor}: {}", raise.because);
            return Ok(self);
        }
        if now < floor * (1.0 - TOLERANCE / 100.0) {
            println!("{id} is {now}, better than {floor}: `cargo xtask guarantees`");
        }
        self.floor = Some(floor.min(now));
        self.raised.clone_from(&before.raised);
        Ok(self)
    }
}

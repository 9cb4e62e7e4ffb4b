//! The records in docs/guarantees.json: one a promise, each with the run that measured it.

use std::fs;
use std::path::PathBuf;

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
    /// The check that measures it: `cargo xtask guarantees --only` takes its name.
    pub check: String,
    pub figure: Value,
    pub bound: String,
    pub unit: String,
    pub limits: String,
    /// Of a golden figure, the lowest that was ever recorded, or the one that it was raised to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<f64>,
    /// Why the floor was raised, and from which figure.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub raised: String,
    pub run: Run,
}

/// Golden figures that may be recorded above their floor, by the beginnings of their names, and the reason.
#[derive(Clone, Copy, Default)]
pub struct Raise<'a> {
    pub names: &'a [String],
    pub because: &'a str,
}

fn json() -> PathBuf {
    workspace::root().join("docs").join("guarantees.json")
}

pub fn committed() -> Result<Vec<Record>> {
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

/// Every promise, and its check, in the order of the document.
pub fn promises() -> impl Iterator<Item = (&'static Check, &'static Promise)> {
    CHECKS.iter().flat_map(|check| check.promises.iter().map(move |promise| (check, promise)))
}

/// Writes both documents. A promise that was not measured keeps its record; so does a golden figure that is
/// above its floor and was not raised, which is an error.
pub fn write(measured: &Measured, raise: Raise<'_>) -> Result<()> {
    let (records, broken) = merge(&committed().unwrap_or_default(), measured, raise);
    save(&records)?;
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}

/// The records after a run, and the promises that the run broke.
fn merge(before: &[Record], measured: &Measured, raise: Raise<'_>) -> (Vec<Record>, Vec<String>) {
    let (mut records, mut broken) = (Vec::new(), Vec::new());
    for (check, promise) in promises() {
        let old = before.iter().find(|record| record.id == promise.id);
        let Some(figure) = measured.figures.get(promise.id) else {
            records.extend(old.cloned());
            continue;
        };
        broken.extend(promise.broken(&measured.figures));
        let figure = figure.clone();
        match Record::new(check, promise, figure, &measured.run).above(old, raise) {
            Ok(record) => records.push(record),
            Err(crept) => {
                broken.push(crept);
                records.extend(old.cloned());
            }
        }
    }
    (records, broken)
}

/// Makes docs/guarantees.md of docs/guarantees.json; measures nothing. A record keeps the words under which its
/// figure was measured.
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

/// Whether every promise was measured and is in the documents, no golden figure is above its floor by more
/// than its tolerance, and the documents agree.
pub fn compare(measured: &Measured) -> Result<()> {
    let before = committed()?;
    let mut broken = Vec::new();
    if fs::read_to_string(json().with_extension("md")).unwrap_or_default()
        != markdown::render(&before)?
    {
        broken
            .push("docs/guarantees.md is not made from guarantees.json: run with --render".into());
    }
    for (check, promise) in promises() {
        let (id, name) = (promise.id, check.name);
        let Some(record) = before.iter().find(|record| record.id == id) else {
            broken.push(format!("{id} is not in docs/guarantees.json: record --only \"{name}\""));
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
        }
    }

    /// With the floor of the record before it, or an error that says how far it is above that.
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

#[cfg(test)]
mod tests {
    use super::super::figures::Figures;
    use super::*;

    fn golden() -> &'static str {
        let golden = promises().find(|(_, promise)| matches!(promise.bound, Bound::Golden));
        golden.expect("a golden figure").1.id
    }

    fn run(commit: &str) -> Run {
        let [date, compiler, machine, emulator] =
            ["2026-01-01T00:00Z", "rustc", "a machine", "QEMU"].map(str::to_owned);
        Run { date, commit: commit.to_owned(), compiler, machine, emulator, size: "full".into() }
    }

    fn measured(commit: &str, figures: &[(&str, f64)]) -> Measured {
        let mut noted = Figures::default();
        figures.iter().for_each(|&(id, value)| noted.note(id, value));
        Measured { figures: noted, skipped: Vec::new(), run: run(commit) }
    }

    fn value(records: &[Record], id: &str) -> f64 {
        records.iter().find(|record| record.id == id).expect("a record").figure.as_f64().unwrap()
    }

    /// 4 % at every recording: with the figure before it as the measure, all of them would pass.
    #[test]
    fn a_golden_figure_does_not_creep_from_recording_to_recording() {
        let id = golden();
        let mut records = Vec::new();
        let mut refused = 0;
        for figure in [100.0, 104.0, 108.0, 112.0] {
            let (after, broken) =
                merge(&records, &measured("a", &[(id, figure)]), Raise::default());
            refused += broken.len();
            records = after;
        }
        assert_eq!((refused, value(&records, id)), (2, 104.0));
        let names = [id.to_owned()];
        let raise = Raise { names: &names, because: "a defect was mended" };
        let (after, broken) = merge(&records, &measured("a", &[(id, 112.0)]), raise);
        assert!(broken.is_empty(), "{broken:?}");
        assert_eq!(after[0].raised, "raised from 100: a defect was mended");
        let (_, broken) = merge(&after, &measured("a", &[(id, 116.0)]), Raise::default());
        assert!(broken.is_empty(), "{broken:?}");
    }

    /// All promises of one commit, but for those of one check.
    #[test]
    fn a_partial_recording_does_not_pass_for_a_whole_one() {
        let all: Vec<(&str, f64)> = promises().map(|(_, promise)| (promise.id, 1.0)).collect();
        let (whole, _) = merge(&[], &measured("aaaa", &all), Raise::default());
        let head = |records: &[Record]| {
            let text = markdown::render(records).expect("text");
            text.split("\n| promise |").next().expect("a head").to_owned()
        };
        assert!(head(&whole).contains("All of it was measured at commit `aaaa`"));
        assert!(!head(&whole).contains("NOT OF ONE"));

        let (partial, _) = merge(&whole, &measured("bbbb", &all[..3]), Raise::default());
        assert!(head(&partial).contains("NOT OF ONE"), "{}", head(&partial));
        for commit in ["aaaa", "bbbb"] {
            assert!(head(&partial).contains(&format!("`{commit}`")), "{}", head(&partial));
        }
        // Rows of the commit that is not the last say so.
        let text = markdown::render(&partial).expect("text");
        let of_old = text.matches("(`aaaa`,").count();
        let rows = partial.iter().filter(|r| r.run.commit == "aaaa" && r.is_shown()).count();
        assert_eq!(of_old, rows);

        assert!(head(&whole[1..]).contains("NOT OF ONE"), "{}", head(&whole[1..]));
        for commit in ["aaaa-dirty", super::super::run::UNKNOWN] {
            let (records, _) = merge(&[], &measured(commit, &all), Raise::default());
            assert!(head(&records).contains("NOT OF ONE"), "{commit}");
        }
    }

    /// The committed head, read by itself, against the committed rows.
    #[test]
    fn the_committed_head_says_what_the_rows_say() {
        let records = committed().expect("records");
        let text = fs::read_to_string(json().with_extension("md")).expect("a document");
        assert!(text == markdown::render(&records).expect("text"), "run with --render");
        let says_whole = text.contains("All of it was measured at commit");
        let mut commits: Vec<&str> = records.iter().map(|r| r.run.commit.as_str()).collect();
        commits.sort_unstable();
        commits.dedup();
        let is_whole = commits.len() == 1
            && records.iter().all(|r| r.run.size != "test" && !r.run.commit.contains("-dirty"))
            && promises().all(|(_, promise)| records.iter().any(|r| r.id == promise.id));
        assert!(!says_whole || is_whole, "the head says more than the rows: {commits:?}");
        assert!(commits.iter().all(|commit| text.contains(&format!("`{commit}`"))), "{commits:?}");
    }
}

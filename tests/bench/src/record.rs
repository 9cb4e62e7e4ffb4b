//! The flat list of records, from which all documents are made.

use std::ops::Deref;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::statistics::Summary;

/// One metric of one method in one cell of one experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// `run` (facts about the run), `brain` (tables 1 and 2), `heart` (table 3), `compare`, `crossover`,
    /// `ablation`, `histogram`, `imaging`, `imaging-heart` and `imaging-run` (their facts), `embedded` and `embedded-run`, `contacts` and
    /// `contacts-run`, `tracker` (on the emulated board) and `tracker-run`.
    pub experiment: String,
    pub mesh: String,
    pub triangles: u64,
    pub tool: String,
    pub method: String,
    pub metric: String,
    #[serde(flatten)]
    pub summary: Summary,
    pub unit: String,
    /// The text of a fact, which is not a number.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
}

impl Deref for Record {
    type Target = Summary;

    fn deref(&self) -> &Summary {
        &self.summary
    }
}

impl Record {
    /// A record of one number.
    pub fn number(cell: &Cell, method: &str, metric: &str, value: f64, unit: &str) -> Self {
        Self::summary(cell, method, metric, &Summary::exactly(value), unit)
    }

    /// A record of a sample.
    pub fn summary(cell: &Cell, method: &str, metric: &str, s: &Summary, unit: &str) -> Self {
        Self {
            experiment: cell.experiment.clone(),
            mesh: cell.mesh.clone(),
            triangles: cell.triangles,
            tool: cell.tool.clone(),
            method: method.to_owned(),
            metric: metric.to_owned(),
            summary: s.map(short),
            unit: unit.to_owned(),
            note: String::new(),
        }
    }

    /// A fact about the run.
    pub fn fact(experiment: &str, metric: &str, note: impl Into<String>) -> Self {
        let cell = Cell { experiment: experiment.to_owned(), ..Cell::default() };
        Self { note: note.into(), ..Self::number(&cell, "", metric, 0.0, "text") }
    }
}

/// The place of a record in the experiments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    pub experiment: String,
    pub mesh: String,
    pub triangles: u64,
    pub tool: String,
}

impl Cell {
    pub fn new(experiment: &str, mesh: &str, triangles: usize, tool: &str) -> Self {
        let [experiment, mesh, tool] = [experiment, mesh, tool].map(str::to_owned);
        Self { experiment, mesh, triangles: triangles as u64, tool }
    }
}

/// Rounds to five significant digits: no measurement is better, and a diff stays readable.
fn short(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// All records of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records(pub Vec<Record>);

impl Records {
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
        Ok(Self(serde_json::from_str(&text).with_context(|| format!("{name} is not a run's"))?))
    }

    /// One record a line, so that a diff shows the changes.
    pub fn json(&self) -> Result<String> {
        let lines: Vec<String> =
            self.0.iter().map(serde_json::to_string).collect::<Result<_, _>>()?;
        Ok(format!("[\n{}\n]\n", lines.join(",\n")))
    }

    pub fn push(&mut self, record: Record) {
        self.0.push(record);
    }

    /// The record of a metric, if the run has it.
    pub fn find(&self, cell: &Cell, method: &str, metric: &str) -> Option<&Record> {
        self.0.iter().find(|r| {
            r.experiment == cell.experiment
                && (&r.mesh, r.triangles) == (&cell.mesh, cell.triangles)
                && r.tool == cell.tool
                && r.method == method
                && r.metric == metric
        })
    }

    /// The note of a fact, or nothing.
    pub fn note(&self, metric: &str) -> &str {
        self.note_of("run", metric)
    }

    /// The note of a fact about an experiment that was recorded by itself, or nothing.
    pub fn note_of(&self, experiment: &str, metric: &str) -> &str {
        let found = self.0.iter().find(|r| r.experiment == experiment && r.metric == metric);
        found.map_or("", |r| &r.note)
    }

    /// The meshes of an experiment, smallest first, each with its number of triangles.
    pub fn meshes(&self, experiment: &str) -> Vec<(String, u64)> {
        let of = self.0.iter().filter(|r| r.experiment == experiment);
        let mut meshes: Vec<_> = of.map(|r| (r.mesh.clone(), r.triangles)).collect();
        meshes.sort_by_key(|(_, triangles)| *triangles);
        meshes.dedup();
        let mut seen = std::collections::HashSet::new();
        meshes.retain(|mesh| seen.insert(mesh.clone()));
        meshes
    }

    /// The methods of an experiment in the order in which they were recorded.
    pub fn methods(&self, experiment: &str, mesh: &str) -> Vec<String> {
        let mut methods: Vec<String> = Vec::new();
        for r in self.0.iter().filter(|r| r.experiment == experiment && r.mesh == mesh) {
            if !r.method.is_empty() && !methods.contains(&r.method) {
                methods.push(r.method.clone());
            }
        }
        methods
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Record, Records};

    /// A brain of each size has its own.
    #[test]
    fn a_record_is_of_its_own_mesh() {
        let cells = [5_000, 50_000].map(|triangles| Cell::new("embedded", "brain", triangles, ""));
        let record = |cell: &Cell| Record::number(cell, "", "nodes", cell.triangles as f64, "");
        let records = Records(cells.iter().map(record).collect());
        for cell in &cells {
            let found = records.find(cell, "", "nodes").map(|record| record.mean);
            assert_eq!(found, Some(cell.triangles as f64));
        }
    }
}

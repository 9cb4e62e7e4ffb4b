//! The queries that have a bound, their bounds, and what the emulated board says of them.

use std::path::Path;

use anyhow::{Context, Result};
use dibs_build::{Mesh, generate};
use dibs_nostd::Cost;
use dibs_tests::surfaces::{ball, slivers};
use glam::Vec3;
use xtask::workspace;

use super::analysis::Analysis;
use super::facts::{Facts, MODAL, MODES, Most, PLAIN};
use super::prices::{Bound, least};
use super::second;
use super::walk::UNIT;
use crate::checks::cost::unseen;
use crate::probe::script::{Draw, Record, Script, Subject};
use crate::probe::{Answer, on_board};

/// Where a query's positions come from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// A table of vertices.
    Rows,
    /// Modes.
    Modes,
    /// Modes, with a memory of positions: without a bound.
    Memory,
}

impl Table {
    /// The table of the queries after a record: a frame of modes is asked about without a memory, then with one.
    pub fn after(self, record: Record) -> Self {
        match (record, self) {
            (Record::Stretch(_), _) => Self::Rows,
            (Record::Bound, Self::Rows) => Self::Modes,
            (Record::Bound, _) => Self::Memory,
            _ => self,
        }
    }
}

/// A kind of query.
pub struct Kind {
    /// For people.
    pub name: &'static str,
    /// In the names of figures.
    pub id: &'static str,
    /// A part of its function's own name in the probe.
    root: &'static str,
    pub is_capsule: bool,
    pub table: Table,
    pub facts: &'static Facts,
    /// The typical constants.
    pub fitted: Option<Cost>,
}

impl Kind {
    /// Whether a record is of a query of this kind, on such a table.
    pub fn is_of(&self, record: Record, table: Table) -> bool {
        let own = self.is_capsule;
        table == self.table
            && matches!(record, Record::Query { is_capsule, .. } if is_capsule == own)
    }
}

/// Plain queries.
pub const KINDS: [Kind; 4] = [
    Kind {
        name: "sphere",
        id: "sphere",
        root: "timed::{closure_env#0}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Rows,
        facts: &PLAIN,
        fitted: Some(Cost::M7_SPHERE),
    },
    Kind {
        name: "capsule",
        id: "capsule",
        root: "timed::{closure_env#0}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Rows,
        facts: &PLAIN,
        fitted: Some(Cost::M7_CAPSULE),
    },
    Kind {
        name: "sphere, a surface of eight modes",
        id: "modal-sphere",
        root: "timed::{closure_env#2}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Modes,
        facts: &MODAL,
        fitted: None,
    },
    Kind {
        name: "capsule, a surface of eight modes",
        id: "modal-capsule",
        root: "timed::{closure_env#2}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Modes,
        facts: &MODAL,
        fitted: None,
    },
];

/// The query whose bound is to be the least: a budget of the firmware, of which a tenth goes to triangles.
const TYPICAL: Most = Most { base: 1, roots: 1, nodes: 1_200, triangles: 30 };

/// A proven bound.
pub struct Proven {
    pub kind: &'static Kind,
    pub analysis: Analysis,
    pub bound: Bound,
    /// Instructions of every query, of each further root, of each node test, of each triangle test: in parts of [`UNIT`].
    constants: [i128; 4],
}

impl Proven {
    /// Of one kind, in the linked probe.
    pub fn new(kind: &'static Kind, probe: &Path, facts: &Facts) -> Result<Self> {
        let analysis = Analysis::new(probe, &workspace::root(), kind.root, facts)
            .with_context(|| format!("the query of a {}", kind.name))?;
        let Analysis { program, system, lines, .. } = &analysis;
        let bound = least(program, system, &TYPICAL, |at| lines.describe(at))?;
        let constants = bound.constants(system);
        Ok(Self { kind, analysis, bound, constants })
    }

    /// The constants, in whole instructions.
    pub fn whole(&self) -> [u32; 4] {
        self.constants.map(|constant| (constant + UNIT - 1).div_euclid(UNIT) as u32)
    }

    /// Base, node test and triangle test, each divided by the typical one.
    pub fn ratios(&self) -> Option<[f64; 3]> {
        let Cost { base, node_test, triangle_test } = self.kind.fitted?;
        let [own_base, _, own_node, own_triangle] = self.whole();
        let pairs = [(own_base, base), (own_node, node_test), (own_triangle, triangle_test)];
        Some(pairs.map(|(own, typical)| f64::from(own) / f64::from(typical)))
    }

    /// The bound on a query of so many further roots and tests, exactly, in parts of [`UNIT`].
    pub fn at(&self, counts: [i64; 3]) -> i128 {
        let [base, each @ ..] = self.constants;
        base + each
            .into_iter()
            .zip(counts)
            .map(|(one, count)| one * i128::from(count))
            .sum::<i128>()
    }

    /// The instructions that another decoder reads alike.
    pub fn decoded(&self, probe: &Path) -> Result<usize> {
        second::agree(&self.analysis, probe)
    }
}

/// Queries of trees with so many roots besides the first.
pub struct Batch {
    pub script: Script,
    roots: i64,
}

impl Batch {
    /// Further roots and tests of an answered query.
    pub fn counts(&self, answer: &Answer<'_>) -> [i64; 3] {
        let [nodes, triangles] = answer.tests().map(i64::from);
        [self.roots, nodes, triangles]
    }
}

/// Queries whose instructions are counted: on surfaces that the typical constants have not seen, and on three surfaces at once;
/// whole ones and such as are cut short, warm and cold.
fn counted(queries: usize) -> Result<Vec<Batch>> {
    let one = unseen()?;
    let draws = [(Draw::Exhausting, 51), (Draw::Any, 52), (Draw::Short, 53)];
    let mut batches: Vec<Batch> = draws
        .into_iter()
        .map(|(draw, seed)| Batch {
            script: Script::about_all(&one, true, queries * 3 / 10, draw, seed),
            roots: 0,
        })
        .collect();
    batches.extend([several(queries / 10, 54), moved(queries / 10, 57)]);
    Ok(batches)
}

/// Queries that are traced.
pub fn to_trace(queries: usize) -> Result<Vec<Batch>> {
    let one = [
        Subject::new("heart", generate::heart(1_280)?.mesh, 8),
        Subject::new("brain", generate::brain(1_200)?, 4),
        Subject::new("ball", ball(3), 8),
        Subject::new("slivers", slivers(60), 1),
    ];
    let script = Script::about_all(&one, false, queries * 4 / 5, Draw::Any, 55);
    Ok(vec![Batch { script, roots: 0 }, several(queries / 5, 56), moved(queries / 2, 58)])
}

/// Queries of three surfaces in one tree.
fn several(queries: usize, seed: u64) -> Batch {
    let mut all = Mesh::default();
    for (part, by) in
        [(ball(2), Vec3::ZERO), (slivers(12), Vec3::X * 150.0), (ball(3), Vec3::Y * 130.0)]
    {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|&position| position + by));
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }
    let subjects = [Subject::new("three surfaces", all, 8)];
    Batch { script: Script::about_all(&subjects, true, queries, Draw::Any, seed), roots: 2 }
}

/// Queries of a heart that modes move; a third of them have no memory of positions.
fn moved(queries: usize, seed: u64) -> Batch {
    Batch { script: Script::modal(MODES, (queries / 16).max(2), seed), roots: 0 }
}

/// Queries on the board, counted.
#[derive(Default)]
pub struct Counted {
    pub queries: usize,
    /// Above their bound.
    pub above: usize,
    /// The largest part of its bound that a query took.
    pub share: f64,
    pub mean_share: f64,
}

/// Counts the instructions of many queries, and compares each with its bound.
pub fn count(proven: &[Proven], probe: &Path, queries: usize) -> Result<Vec<Counted>> {
    let mut found: Vec<Counted> = proven.iter().map(|_| Counted::default()).collect();
    for batch in counted(queries)? {
        let mut table = Table::Rows;
        for answer in on_board(probe, &batch.script, true)?.iter() {
            table = table.after(answer.record);
            let all = proven.iter().zip(&mut found);
            for (proven, found) in all.filter(|(one, _)| one.kind.is_of(answer.record, table)) {
                let took = i128::from(answer.instructions) * UNIT;
                let bound = proven.at(batch.counts(&answer));
                let share = took as f64 / bound as f64;
                found.queries += 1;
                found.above += usize::from(took > bound);
                found.share = found.share.max(share);
                found.mean_share += share;
            }
        }
    }
    for found in &mut found {
        found.mean_share /= found.queries.max(1) as f64;
    }
    Ok(found)
}

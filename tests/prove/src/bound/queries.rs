//! The kinds of queries that have a bound, their bounds, and measurements on the emulated board.

use std::path::Path;

use anyhow::{Context, Result};
use dibs_build::{Mesh, Motion, generate};
use dibs_nostd::Cost;
use dibs_tests::motions::trembling;
use dibs_tests::surfaces::{ball, slivers};
use glam::Vec3;
use xtask::workspace;

use super::analysis::Analysis;
use super::cycles::Cycles;
use super::facts::{EMBEDDED, Facts, MODAL, MODES, MOVING, Most, PLAIN};
use super::prices::{Bound, least};
use super::second::Listing;
use super::sided::{RING, SIDED_CAPSULE, SIDED_SPHERE};
use super::walk::UNIT;
use crate::checks::cost::unseen;
use crate::probe::script::{Draw, Record, Script, Subject, Table};
use crate::probe::{Answer, on_board};

/// A kind of query.
pub struct Kind {
    pub name: &'static str,
    /// Its name in the names of figures.
    pub id: &'static str,
    /// A part of the name of its function in the probe.
    pub root: &'static str,
    pub is_capsule: bool,
    pub table: Table,
    /// Whether it asks for the side.
    pub is_signed: bool,
    pub facts: &'static Facts,
    /// The fitted constants for typical queries.
    pub fitted: Option<Cost>,
}

impl Kind {
    /// Whether a record is of a query of this kind.
    pub fn is_of(&self, record: Record) -> bool {
        let own = (self.is_capsule, self.table, self.is_signed);
        matches!(record, Record::Query { is_capsule, table, is_signed, .. }
            if (is_capsule, table, is_signed) == own)
    }

    /// Whether a script has queries of this kind.
    pub fn has_part_in(&self, script: &Script) -> bool {
        script.records.iter().any(|&record| self.is_of(record))
    }
}

/// Plain queries, then those with side.
pub const KINDS: [Kind; 10] = [
    Kind {
        name: "sphere",
        id: "sphere",
        root: "timed::{closure_env#0}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Rows,
        is_signed: false,
        facts: &PLAIN,
        fitted: Some(Cost::M7_SPHERE),
    },
    Kind {
        name: "capsule",
        id: "capsule",
        root: "timed::{closure_env#0}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Rows,
        is_signed: false,
        facts: &PLAIN,
        fitted: Some(Cost::M7_CAPSULE),
    },
    Kind {
        name: "sphere, a moving surface",
        id: "moving-sphere",
        root: "timed::{closure_env#4}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Moving,
        is_signed: false,
        facts: &MOVING,
        fitted: None,
    },
    Kind {
        name: "capsule, a moving surface",
        id: "moving-capsule",
        root: "timed::{closure_env#4}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Moving,
        is_signed: false,
        facts: &MOVING,
        fitted: None,
    },
    Kind {
        name: "sphere, a surface that nodes carry",
        id: "embedded-sphere",
        root: "timed::{closure_env#5}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Nodes,
        is_signed: false,
        facts: &EMBEDDED,
        fitted: None,
    },
    Kind {
        name: "capsule, a surface that nodes carry",
        id: "embedded-capsule",
        root: "timed::{closure_env#5}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Nodes,
        is_signed: false,
        facts: &EMBEDDED,
        fitted: None,
    },
    Kind {
        name: "sphere, a surface of eight modes",
        id: "modal-sphere",
        root: "timed::{closure_env#2}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Modes,
        is_signed: false,
        facts: &MODAL,
        fitted: None,
    },
    Kind {
        name: "capsule, a surface of eight modes",
        id: "modal-capsule",
        root: "timed::{closure_env#2}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Modes,
        is_signed: false,
        facts: &MODAL,
        fitted: None,
    },
    Kind {
        name: "sphere with side",
        id: "sided-sphere",
        root: "timed::{closure_env#0}<dibs_nostd::tool::sphere::Sphere",
        is_capsule: false,
        table: Table::Rows,
        is_signed: true,
        facts: &SIDED_SPHERE,
        fitted: None,
    },
    Kind {
        name: "capsule with side, outside",
        id: "sided-capsule",
        root: "timed::{closure_env#0}<dibs_nostd::tool::capsule::Capsule",
        is_capsule: true,
        table: Table::Rows,
        is_signed: true,
        facts: &SIDED_CAPSULE,
        fitted: None,
    },
];

/// The query for which the bound is minimised: a budget of the firmware, of which a tenth is spent on triangles.
pub(super) const TYPICAL: Most = Most { base: 1, roots: 1, nodes: 1_200, triangles: 30 };

/// A proven bound.
pub struct Proven {
    pub kind: &'static Kind,
    pub analysis: Analysis,
    pub bound: Bound,
    /// Instructions of every query, each further root, each node test and each triangle test, in units of 1 / [`UNIT`].
    constants: [i128; 4],
}

impl Proven {
    /// The bound for one kind, in the linked probe.
    pub fn new(kind: &'static Kind, probe: &Path, facts: &Facts) -> Result<Self> {
        let analysis = Analysis::new(probe, &workspace::root(), kind.root, facts)
            .with_context(|| format!("the query of a {}", kind.name))?;
        let Analysis { program, system, lines, .. } = &analysis;
        let bound = least(program, system, &TYPICAL, &|_| 1, |at| lines.describe(at))
            .with_context(|| format!("the query of a {}", kind.name))?;
        let constants = bound.constants(system);
        Ok(Self { kind, analysis, bound, constants })
    }

    /// The constants, in whole instructions.
    pub fn whole(&self) -> [u32; 4] {
        whole(self.constants)
    }

    /// The constants in cycles of a model.
    pub fn cycles(&self, listing: &Listing) -> Result<[u32; 4]> {
        let Analysis { program, system, lines, .. } = &self.analysis;
        let cycles = Cycles::new(&self.analysis, listing)?;
        let describe = |at| lines.describe(at);
        let bound = least(program, system, &TYPICAL, &|at| cycles.at(at), describe)?;
        Ok(whole(bound.constants(system)))
    }

    /// Base, node test and triangle test, each divided by the fitted constant.
    pub fn ratios(&self) -> Option<[f64; 3]> {
        let Cost { base, node_test, triangle_test } = self.kind.fitted?;
        let [own_base, _, own_node, own_triangle] = self.whole();
        let pairs = [(own_base, base), (own_node, node_test), (own_triangle, triangle_test)];
        Some(pairs.map(|(own, typical)| f64::from(own) / f64::from(typical)))
    }

    /// The exact bound for a query with this many further roots and tests, in units of 1 / [`UNIT`].
    pub fn at(&self, counts: [i64; 3]) -> i128 {
        let [base, each @ ..] = self.constants;
        base + each
            .into_iter()
            .zip(counts)
            .map(|(one, count)| one * i128::from(count))
            .sum::<i128>()
    }
}

/// Rounded up to whole units.
fn whole(constants: [i128; 4]) -> [u32; 4] {
    constants.map(|constant| (constant + UNIT - 1).div_euclid(UNIT) as u32)
}

/// Further roots and tests of an answered query.
pub fn counts(answer: &Answer<'_>) -> [i64; 3] {
    let roots = match answer.record {
        Record::Query { roots, .. } => roots,
        _ => 0,
    };
    let [nodes, triangles] = answer.tests();
    [roots, nodes, triangles].map(i64::from)
}

/// Most queries, or ticks, of scripts that are in memory at the same time.
const ROUND: usize = 10_000;

/// Rounds of equal size for this many queries, and what to add to their seeds.
pub(super) fn rounds(queries: usize) -> impl Iterator<Item = (usize, u64)> {
    let rounds = queries.div_ceil(ROUND).max(1);
    (0..rounds as u64).map(move |round| (queries / rounds, 100 * round))
}

/// Queries whose instructions are counted: on surfaces that the constants were not fitted to, and on three surfaces in
/// one tree; complete and cut short, warm and cold.
fn counted(queries: usize, seed: u64) -> Result<Vec<Script>> {
    let one = unseen()?;
    let draws = [(Draw::Exhausting, 51), (Draw::Any, 52), (Draw::Short, 53)];
    let about = |(draw, own)| Script::about_all(&one, true, queries * 3 / 10, draw, seed + own);
    let mut scripts: Vec<Script> = draws.into_iter().map(about).collect();
    scripts.push(several(queries / 10, seed + 54));
    scripts.extend(moved(10_272, queries / 10, seed + 57)?);
    let closed = closed(generate::heart(2_562)?.mesh, ball(4));
    for (draw, own) in [(Draw::Exhausting, 59), (Draw::Any, 60), (Draw::Short, 61)] {
        scripts.push(Script::sided(&closed, RING, queries / 10, draw, seed + own)?);
    }
    Ok(scripts)
}

pub fn to_trace(queries: usize) -> Result<Vec<Script>> {
    let one = [
        Subject::new("heart", generate::heart(1_280)?.mesh, 8),
        Subject::new("brain", generate::brain(1_200)?, 4),
        Subject::new("ball", ball(3), 8),
        Subject::new("slivers", slivers(60), 1),
    ];
    let script = Script::about_all(&one, false, queries * 4 / 5, Draw::Any, 55);
    let mut scripts = vec![script, several(queries / 5, 56)];
    scripts.extend(moved(1_280, queries / 2, 58)?);
    let closed = closed(generate::heart(1_280)?.mesh, ball(3));
    scripts.push(Script::sided(&closed, RING, queries / 2, Draw::Any, 62)?);
    Ok(scripts)
}

/// Closed surfaces.
fn closed(heart: Mesh, ball: Mesh) -> [Subject; 2] {
    [Subject::new("heart", heart, 8), Subject::new("ball", ball, 4)]
}

/// Queries of three surfaces in one tree.
fn several(queries: usize, seed: u64) -> Script {
    let mut all = Mesh::default();
    for (part, by) in
        [(ball(2), Vec3::ZERO), (slivers(12), Vec3::X * 150.0), (ball(3), Vec3::Y * 130.0)]
    {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|&position| position + by));
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }
    let subjects = [Subject::new("three surfaces", all, 8)];
    Script::about_all(&subjects, true, queries, Draw::Any, seed)
}

/// Queries of a heart of so many triangles that modes, nodes and frames move, and of three hearts, complete and cut
/// short, warm and cold. A third of those with modes have no cache of positions.
fn moved(triangles: u32, queries: usize, seed: u64) -> Result<Vec<Script>> {
    let of_frame = (queries / 32).max(2);
    let waves = MODES.div_ceil(2);
    let one = trembling(triangles, waves, seed);
    let three = beside(&trembling(1_280, waves, seed), 3);
    let mut scripts = Vec::new();
    for (mesh, motion) in [&one, &three] {
        scripts.push(Script::modal_of(mesh, motion, MODES, of_frame, Draw::Any, seed));
        scripts.push(Script::moving_of(mesh, motion, queries / 2, Draw::Any, seed));
    }
    let heart = generate::heart(triangles)?.mesh;
    scripts.push(Script::embedded_of(&heart, 7, queries, Draw::Any, seed));
    Ok(scripts)
}

/// Several copies of a surface beside each other, with the same motion.
pub(super) fn beside((mesh, motion): &(Mesh, Motion), count: u32) -> (Mesh, Motion) {
    let (mut all, mut moved) = (Mesh::default(), motion.clone());
    moved.frames.iter_mut().for_each(Vec::clear);
    for number in 0..count {
        let by = Vec3::X * 150.0 * number as f32;
        let first = all.positions.len() as u32;
        let shifted = |positions: &[Vec3]| positions.iter().map(|&at| at + by).collect::<Vec<_>>();
        all.positions.extend(shifted(&mesh.positions));
        all.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|v| v + first)));
        let frames = moved.frames.iter_mut().zip(&motion.frames);
        frames.for_each(|(all, own)| all.extend(shifted(own)));
    }
    (all, moved)
}

/// Results of counted queries.
#[derive(Default)]
pub struct Counted {
    pub queries: usize,
    /// Number of queries above their bound.
    pub above: usize,
    /// The largest fraction of its bound that a query took.
    pub share: f64,
    pub mean_share: f64,
}

impl Counted {
    /// Adds a query that took so much, and whose bound is this.
    pub fn add(&mut self, took: i128, bound: i128) {
        let share = took as f64 / bound as f64;
        self.queries += 1;
        self.above += usize::from(took > bound);
        self.share = self.share.max(share);
        self.mean_share += share;
    }

    /// After the last.
    pub fn end(self) -> Self {
        Self { mean_share: self.mean_share / self.queries.max(1) as f64, ..self }
    }
}

/// Counts the instructions of many queries, and compares each with its bound.
pub fn count(proven: &[Proven], probe: &Path, queries: usize) -> Result<Vec<Counted>> {
    let mut found: Vec<Counted> = proven.iter().map(|_| Counted::default()).collect();
    for (queries, seed) in rounds(queries) {
        for script in counted(queries, seed)? {
            for answer in on_board(probe, &script, true)?.iter() {
                let all = proven.iter().zip(&mut found);
                for (proven, found) in all.filter(|(one, _)| one.kind.is_of(answer.record)) {
                    let took = i128::from(answer.instructions) * UNIT;
                    found.add(took, proven.at(counts(&answer)));
                }
            }
        }
    }
    Ok(found.into_iter().map(Counted::end).collect())
}

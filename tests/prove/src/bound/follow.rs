//! Follows queries on the emulated board instruction by instruction, and compares the graph and the facts with the
//! execution.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::analysis::Analysis;
use super::facts::{Facts, WITHOUT_EDGES};
use super::queries::{KINDS, Kind, Proven, counts, to_trace};
use super::sided::SIDED_WITHOUT_EDGES;
use super::trace::{Follower, OffGraph, Run};
use super::walk::UNIT;
use crate::probe::script::{Script, Table};
use crate::probe::{Answers, traced};

/// Node tests of an answer that are counted in addition to the executed ones.
const ROOT: i64 = 1;

/// Results of the traces.
#[derive(Default)]
pub struct Traced {
    pub queries: usize,
    pub instructions: u64,
    /// Facts that some query violated, with the number of such queries.
    pub broken: Vec<(&'static str, usize)>,
    /// Facts that hold with equality in some query that executes what they limit, so they cannot be tighter.
    pub tight: Vec<&'static str>,
    /// Facts for which no query executed what they limit: no trace shows whether they hold.
    pub untried: Vec<&'static str>,
    /// Number of blocks that some query executed.
    pub reached: usize,
    pub blocks: usize,
}

/// Follows every instruction of some queries along the graphs of their kinds, and compares them with the facts. A path
/// that is not in the graph is an error.
pub fn trace(proven: &[Proven], probe: &Path, scripts: &[Script]) -> Result<Vec<Traced>> {
    let mut ranges = BTreeMap::new();
    for Analysis { program, image, .. } in proven.iter().map(|one| &one.analysis) {
        for &at in program.functions.keys() {
            ranges.insert(at, u64::from(at)..u64::from(image.symbol(at)?.end));
        }
    }
    let ranges: Vec<_> = ranges.into_values().collect();
    let mut followed: Vec<Followed<'_>> = proven.iter().map(Followed::new).collect();
    for script in scripts {
        // Kinds with and without a side are the same function, so a script has one of them.
        let is_of = |one: &&mut Followed<'_>| one.proven.kind.has_part_in(script);
        let mut now: Vec<&mut Followed<'_>> = followed.iter_mut().filter(is_of).collect();
        let answers = traced(probe, script, &ranges, |at| {
            now.iter_mut().try_for_each(|one| one.follower.step(at as u32))
        })?;
        for one in now {
            one.compare(&answers)?;
        }
    }
    Ok(followed.into_iter().map(Followed::end).collect())
}

/// What queries have shown about a fact.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// Queries that violated it.
    broken: usize,
    /// Whether a query executed what it limits.
    is_tried: bool,
    /// Whether such a query reached equality.
    is_tight: bool,
}

/// A kind of query that is followed.
struct Followed<'a> {
    proven: &'a Proven,
    follower: Follower<'a>,
    found: Traced,
    /// What the queries have shown about each fact.
    state: Vec<Seen>,
}

impl<'a> Followed<'a> {
    fn new(proven: &'a Proven) -> Self {
        let Analysis { program, system, .. } = &proven.analysis;
        let found = Traced { blocks: program.blocks(), ..Traced::default() };
        let state = vec![Seen::default(); system.rows.len()];
        Self { proven, follower: Follower::new(program), found, state }
    }

    /// Compares the runs of a script with its answers.
    fn compare(&mut self, answers: &Answers) -> Result<()> {
        let runs = self.follower.runs();
        let mut queries = 0;
        for answer in answers.iter() {
            if !self.proven.kind.is_of(answer.record) {
                continue;
            }
            let run = runs.get(queries).context("a query without a run")?;
            compare(self.proven, run, counts(&answer), &mut self.state)?;
            self.found.instructions += run.instructions;
            queries += 1;
        }
        self.found.queries += queries;
        ensure!(queries == runs.len(), "{} runs of {queries} queries", runs.len());
        Ok(())
    }

    fn end(mut self) -> Traced {
        let rows = || self.proven.analysis.system.rows.iter().zip(&self.state);
        let named = |is_it: fn(&Seen) -> bool| {
            rows().filter(|(_, seen)| is_it(seen)).map(|(row, _)| row.name).collect()
        };
        let broken = rows().filter(|(_, seen)| seen.broken > 0);
        self.found.broken = broken.map(|(row, seen)| (row.name, seen.broken)).collect();
        self.found.tight = named(|seen| seen.is_tight);
        self.found.untried = named(|seen| !seen.is_tried);
        self.found.reached = self.follower.reached();
        self.found
    }
}

/// Compares one query with each fact, and with the bound.
fn compare(proven: &Proven, run: &Run, counts: [i64; 3], state: &mut [Seen]) -> Result<()> {
    for (row, seen) in proven.analysis.system.rows.iter().zip(state) {
        let (left, right) = (run.left(row), row.most.of(counts));
        seen.broken += usize::from(left > right);
        seen.is_tried |= run.is_of(row);
        seen.is_tight |= left == right && run.is_of(row);
    }
    // A query's own counts must equal the executed parts of these facts: no part is missed, and none is counted twice.
    for (name, counted, spare) in
        [("node tests", counts[1], ROOT), ("triangle tests", counts[2], 0)]
    {
        let row = proven.analysis.system.rows.iter().find(|row| row.name == name);
        let left = run.left(row.with_context(|| format!("no fact of {name}"))?);
        let is_counted = (counted - spare..=counted).contains(&left);
        ensure!(is_counted, "{counted} {name} were counted, and {left} were executed");
    }
    let took = run.instructions;
    ensure!(
        i128::from(took) * UNIT <= proven.at(counts),
        "a traced query of {took} instructions is above its bound"
    );
    Ok(())
}

/// Tests whether a trace finds each of two planted errors: a wrong fact, and a path that the graph does not contain.
pub fn planted(kind: &'static Kind, probe: &Path, fault: &Fault) -> Result<[bool; 2]> {
    let scripts = to_trace(40)?;
    let is_of = |script: &&Script| kind.has_part_in(script);
    let script = scripts.iter().find(is_of).context("no script")?;
    let script = std::slice::from_ref(script);
    let mut wrong = Proven::new(kind, probe, kind.facts)?;
    wrong.analysis.system.narrow(fault.narrowed);
    let traced = trace(&[wrong], probe, script)?;
    let is_broken = traced.iter().any(|traced| !traced.broken.is_empty());
    let shorter = Proven::new(kind, probe, fault.shorter)?;
    let left = trace(&[shorter], probe, script).err();
    let is_left = left.is_some_and(|error| error.downcast_ref::<OffGraph>().is_some());
    Ok([is_broken, is_left])
}

/// The errors that are planted in a kind of query.
pub struct Fault {
    /// The fact that is made wrong.
    pub narrowed: &'static str,
    /// The facts with a call that is never made, and is.
    pub shorter: &'static Facts,
}

/// The kinds with planted errors.
pub fn faults() -> impl Iterator<Item = (&'static Kind, Fault)> {
    KINDS.iter().filter(|kind| kind.is_capsule && kind.table == Table::Rows).map(|kind| {
        let (narrowed, shorter) = if kind.is_signed {
            ("planes of ties", &SIDED_WITHOUT_EDGES)
        } else {
            ("turns of a leaf", &WITHOUT_EDGES)
        };
        (kind, Fault { narrowed, shorter })
    })
}

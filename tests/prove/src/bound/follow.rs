//! Follows queries on the emulated board instruction by instruction, and compares the graph and the facts with the
//! execution.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::analysis::Analysis;
use super::facts::{Facts, WITHOUT_EDGES};
use super::queries::{KINDS, Kind, Proven, counts, to_trace};
use super::sided::SIDED_WITHOUT_EDGES;
use super::trace::{Follower, OffGraph, Run};
use super::walk::UNIT;
use crate::probe::script::{Script, Table};
use crate::probe::{traced, traced_words};

/// Node tests of an answer that are counted in addition to the executed ones.
pub const ROOT: i64 = 1;

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
    let ranges = ranges(proven)?;
    let mut followed: Vec<Followed<'_>> = proven.iter().map(Followed::new).collect();
    for script in scripts {
        // Kinds with and without a side are the same function, so a script has one of them.
        let is_of = |one: &&mut Followed<'_>| one.proven.kind.has_part_in(script);
        let mut now: Vec<&mut Followed<'_>> = followed.iter_mut().filter(is_of).collect();
        let answers = traced(probe, script, &ranges, |at| {
            now.iter_mut().try_for_each(|one| one.follower.step(at as u32))
        })?;
        for one in now {
            let kind = one.proven.kind;
            let own = answers.iter().filter(|answer| kind.is_of(answer.record));
            one.compare(own.map(|answer| Asked { counts: counts(&answer), spare: Some(ROOT) }))?;
        }
    }
    Ok(followed.into_iter().map(Followed::end).collect())
}

/// Addresses of the functions of some programs.
fn ranges(proven: &[Proven]) -> Result<Vec<Range<u64>>> {
    let mut ranges = BTreeMap::new();
    for Analysis { program, image, .. } in proven.iter().map(|one| &one.analysis) {
        for &at in program.functions.keys() {
            ranges.insert(at, u64::from(at)..u64::from(image.symbol(at)?.end));
        }
    }
    Ok(ranges.into_values().collect())
}

/// The same for a tracker's ticks. `read` converts the words that the probe answers to the script of this number.
pub fn trace_ticks<'s>(
    proven: &Proven,
    probe: &Path,
    scripts: impl Iterator<Item = &'s [u8]>,
    read: impl Fn(usize, &[u32]) -> Vec<Asked>,
) -> Result<Traced> {
    let ranges = ranges(std::slice::from_ref(proven))?;
    let mut followed = Followed::new(proven);
    for (number, script) in scripts.enumerate() {
        let step = |at| followed.follower.step(at as u32);
        let words = traced_words(probe, script, &ranges, step)?;
        followed.compare(read(number, &words).into_iter())?;
    }
    Ok(followed.end())
}

/// An answered question.
pub struct Asked {
    /// Further roots, node tests and triangle tests.
    pub counts: [i64; 3],
    /// The most node tests that it counted, and did not make; not known for a part of them.
    pub spare: Option<i64>,
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
    fn compare(&mut self, answers: impl Iterator<Item = Asked>) -> Result<()> {
        let runs = self.follower.runs();
        let mut queries = 0;
        for asked in answers {
            let run = runs.get(queries).context("a query without a run")?;
            compare(self.proven, run, &asked, &mut self.state)?;
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
fn compare(proven: &Proven, run: &Run, asked: &Asked, state: &mut [Seen]) -> Result<()> {
    let counts = asked.counts;
    for (row, seen) in proven.analysis.system.rows.iter().zip(state) {
        let (left, right) = (run.left(row), row.most.of(counts));
        seen.broken += usize::from(left > right);
        seen.is_tried |= run.is_of(row);
        seen.is_tight |= left == right && run.is_of(row);
    }
    // A query's own counts must equal the executed parts of these facts: no part is missed, and none is counted twice.
    let Some(spare) = asked.spare else { return ensure_below(proven, run, counts) };
    for (name, counted, spare) in
        [("node tests", counts[1], spare), ("triangle tests", counts[2], 0)]
    {
        let row = proven.analysis.system.rows.iter().find(|row| row.name == name);
        let row = row.with_context(|| format!("no fact of {name}"))?;
        let (left, times) = (run.left(row), row.most.nodes + row.most.triangles);
        let is_counted = (times * (counted - spare)..=row.most.of(counts)).contains(&left);
        ensure!(is_counted, "{counted} {name} were counted, and {left} / {times} were executed");
    }
    ensure_below(proven, run, counts)
}

fn ensure_below(proven: &Proven, run: &Run, counts: [i64; 3]) -> Result<()> {
    let took = run.instructions;
    ensure!(
        i128::from(took) * UNIT <= proven.at(counts),
        "a traced query of {took} instructions is above its bound"
    );
    Ok(())
}

/// Tests whether a trace finds each of two planted errors: a wrong fact, and a path that the graph does not contain.
pub fn planted(
    kind: &'static Kind,
    probe: &Path,
    fault: &Fault,
    trace: impl Fn(Proven) -> Result<Traced>,
) -> Result<[bool; 2]> {
    let mut wrong = Proven::new(kind, probe, kind.facts)?;
    wrong.analysis.system.narrow(fault.narrowed);
    let is_broken = !trace(wrong)?.broken.is_empty();
    let left = trace(Proven::new(kind, probe, fault.shorter)?).err();
    let is_left = left.is_some_and(|error| error.downcast_ref::<OffGraph>().is_some());
    Ok([is_broken, is_left])
}

/// The same for a kind of query.
pub fn planted_in_queries(kind: &'static Kind, probe: &Path, fault: &Fault) -> Result<[bool; 2]> {
    let scripts = to_trace(40)?;
    let script = scripts.iter().find(|script| kind.has_part_in(script)).context("no script")?;
    planted(kind, probe, fault, |proven| {
        let traced = trace(&[proven], probe, std::slice::from_ref(script))?;
        traced.into_iter().next().context("no trace")
    })
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

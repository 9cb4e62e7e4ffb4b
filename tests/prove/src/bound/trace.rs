//! Compares the execution on an emulated processor with the graph and the facts.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::mem::take;

use anyhow::Result;

use super::graph::Program;
use super::system::{Part, Row};

/// An executed instruction that no path of the graph leads to.
#[derive(Debug)]
pub struct OffGraph(String);

impl std::error::Error for OffGraph {}

impl fmt::Display for OffGraph {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

fn on_graph(is_on: bool, text: impl FnOnce() -> String) -> Result<(), OffGraph> {
    if is_on { Ok(()) } else { Err(OffGraph(text())) }
}

/// One run of the root function.
#[derive(Default)]
pub struct Run {
    pub instructions: u64,
    counts: BTreeMap<Part, i64>,
}

impl Run {
    /// Whether the run executed anything that a fact limits.
    pub fn is_of(&self, row: &Row) -> bool {
        let mut limited = row.coefficients.iter().filter(|(_, times)| **times > 0);
        limited.any(|(part, _)| self.counts.contains_key(part))
    }

    /// The left side of a fact in this run.
    pub fn left(&self, row: &Row) -> i64 {
        let terms = row.coefficients.iter();
        terms.map(|(part, times)| times * self.counts.get(part).copied().unwrap_or_default()).sum()
    }
}

/// A function that is being executed.
struct Level {
    function: u32,
    block: usize,
    /// Number of executed instructions of the present block.
    done: usize,
    /// Whether the call at the block's end was made.
    has_called: bool,
}

impl Level {
    fn start(function: u32, block: usize) -> Self {
        Self { function, block, done: 1, has_called: false }
    }
}

/// Follows executed instructions along the graph.
pub struct Follower<'a> {
    program: &'a Program,
    levels: Vec<Level>,
    run: Run,
    /// The runs that have ended.
    runs: Vec<Run>,
    /// Blocks that were executed.
    reached: BTreeSet<Part>,
}

impl<'a> Follower<'a> {
    pub fn new(program: &'a Program) -> Self {
        let (levels, runs) = (Vec::new(), Vec::new());
        Self { program, levels, run: Run::default(), runs, reached: BTreeSet::new() }
    }

    /// Ends the present run, and takes all runs since the last call.
    pub fn runs(&mut self) -> Vec<Run> {
        if !self.levels.is_empty() {
            self.levels.clear();
            self.runs.push(take(&mut self.run));
        }
        take(&mut self.runs)
    }

    /// The number of blocks that were executed.
    pub fn reached(&self) -> usize {
        self.reached.iter().filter(|part| matches!(part, Part::Block(..))).count()
    }

    /// Processes the next executed instruction. It is an error if no path of the graph leads to it.
    pub fn step(&mut self, at: u32) -> Result<()> {
        loop {
            let Some(level) = self.levels.last_mut() else {
                if at == self.program.root {
                    self.enter(at);
                }
                return Ok(());
            };
            let function = &self.program.functions[&level.function];
            let block = &function.blocks[level.block];
            if let Some(&next) = block.instructions.get(level.done) {
                on_graph(next == at, || {
                    format!("{at:#x} instead of {next:#x} in {}", function.name)
                })?;
                level.done += 1;
                self.run.instructions += 1;
                return Ok(());
            }
            if block.call == Some(at) && !level.has_called {
                level.has_called = true;
                self.enter(at);
                return Ok(());
            }
            let may_go_on = block.call.is_none() || level.has_called || block.is_call_conditional;
            on_graph(may_go_on, || {
                format!("{at:#x} without the call before it in {}", function.name)
            })?;
            let edges = || block.out.iter().map(|&edge| (edge, &function.edges[edge]));
            let leads = |to: usize| function.blocks[to].instructions[0] == at;
            let of = level.function;
            if let Some((edge, to)) =
                edges().find_map(|(number, edge)| Some((number, edge.to.filter(|&to| leads(to))?)))
            {
                *level = Level::start(of, to);
                self.count(Part::Edge(of, edge));
                self.count(Part::Block(of, to));
                self.run.instructions += 1;
                return Ok(());
            }
            let Some((edge, end)) = edges().find(|(_, edge)| edge.to.is_none()) else {
                let last = block.instructions[level.done - 1];
                return Err(
                    OffGraph(format!("{at:#x} after {last:#x} in {}", function.name)).into()
                );
            };
            self.levels.pop();
            self.count(Part::Edge(of, edge));
            if let Some(tail) = end.tail {
                on_graph(tail == at, || {
                    format!("{at:#x} instead of {tail:#x} after {}", function.name)
                })?;
                self.enter(at);
                return Ok(());
            }
            if self.levels.is_empty() {
                self.runs.push(take(&mut self.run));
            }
        }
    }

    fn enter(&mut self, function: u32) {
        self.levels.push(Level::start(function, 0));
        self.count(Part::Block(function, 0));
        self.run.instructions += 1;
    }

    fn count(&mut self, part: Part) {
        *self.run.counts.entry(part).or_default() += 1;
        self.reached.insert(part);
    }
}

//! The longest walk through a program whose facts have prices, in integers: it proves a bound.
//!
//! Each execution of a part gains its instructions, or their cycles, and pays the prices of the facts that count it. If no cycle has a
//! gain, no walk gains more than the longest walk without a cycle, `W`. So any run of the program takes at most `W`
//! plus the sum over the facts of price times right side: this is a bound, however the prices were chosen. (In terms of
//! linear programming the prices are a dual solution, and this walk proves that it is feasible.)

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, ensure};

use super::graph::{Function, Program};
use super::system::{Part, System};

/// Fixed-point unit: the numbers below count fractions 1 / UNIT of an instruction or cycle.
pub const UNIT: i128 = 1 << 20;

/// Instructions, or their cycles, and facts along a walk.
#[derive(Clone, Default, Debug)]
pub struct Walk {
    pub length: i64,
    /// How often each fact is counted.
    pub counts: BTreeMap<usize, i64>,
    /// A block on the walk, for messages.
    pub through: u32,
}

impl Walk {
    fn add(&mut self, other: &Self) {
        self.length += other.length;
        for (&fact, &count) in &other.counts {
            *self.counts.entry(fact).or_default() += count;
        }
    }

    fn pay(&mut self, system: &System, part: Part) {
        for &(fact, count) in system.of(part) {
            *self.counts.entry(fact).or_default() += count;
        }
    }

    fn gain(&self, prices: &[i128]) -> i128 {
        let paid = self.counts.iter().map(|(&fact, &count)| prices[fact] * i128::from(count));
        i128::from(self.length) * UNIT - paid.sum::<i128>()
    }
}

/// The longest walk, or cycles with a gain.
pub enum Longest {
    Walk(Walk, i128),
    Cycles(Vec<Walk>),
}

/// Finds the longest walk from the root's entry to its end. `weigh` gives the length of an instruction at an address: 1, or
/// its cycles.
pub fn longest(
    program: &Program,
    system: &System,
    prices: &[i128],
    weigh: &dyn Fn(u32) -> i64,
) -> Result<Longest> {
    ensure!(prices.iter().all(|&price| price >= 0), "a price below zero");
    let mut known: BTreeMap<u32, Option<(Walk, i128)>> = BTreeMap::new();
    let mut cycles = Vec::new();
    for at in &program.order {
        let function = &program.functions[at];
        // The longest walk through a callee is unknown as long as a cycle in it has a gain.
        if function.callees().any(|callee| known.get(&callee).is_none_or(Option::is_none)) {
            known.insert(*at, None);
            continue;
        }
        let walks: BTreeMap<_, _> =
            known.iter().filter_map(|(&at, walk)| Some((at, walk.as_ref()?))).collect();
        let found = Search::new(function, system, prices, &walks, weigh).run()?;
        let (walk, own) = found.map_or_else(|cycles| (None, cycles), |walk| (Some(walk), vec![]));
        known.insert(*at, walk);
        cycles.extend(own);
    }
    match known.remove(&program.root).flatten() {
        Some((walk, gain)) => Ok(Longest::Walk(walk, gain)),
        None => Ok(Longest::Cycles(cycles)),
    }
}

/// A search in one function.
struct Search<'a> {
    function: &'a Function,
    system: &'a System,
    callees: &'a BTreeMap<u32, &'a (Walk, i128)>,
    weigh: &'a dyn Fn(u32) -> i64,
    /// For each edge: the gain of its block, of the call at the block's end, and of the edge itself.
    gains: Vec<i128>,
}

impl<'a> Search<'a> {
    fn new(
        function: &'a Function,
        system: &'a System,
        prices: &[i128],
        callees: &'a BTreeMap<u32, &'a (Walk, i128)>,
        weigh: &'a dyn Fn(u32) -> i64,
    ) -> Self {
        let mut search = Self { function, system, callees, weigh, gains: Vec::new() };
        search.gains =
            (0..function.edges.len()).map(|edge| search.walk(edge).gain(prices)).collect();
        search
    }

    /// The length and the facts of the edge and the block before it.
    fn walk(&self, number: usize) -> Walk {
        let edge = &self.function.edges[number];
        let block = &self.function.blocks[edge.from];
        let length = block.instructions.iter().map(|&at| (self.weigh)(at)).sum();
        let mut walk = Walk { length, through: block.instructions[0], ..Walk::default() };
        walk.pay(self.system, Part::Block(self.function.start, edge.from));
        walk.pay(self.system, Part::Edge(self.function.start, number));
        if let Some((callee, gain)) = block.call.and_then(|callee| self.callees.get(&callee))
            && !(block.is_call_conditional && *gain < 0)
        {
            walk.add(callee);
        }
        if let Some((callee, _)) = edge.tail.and_then(|callee| self.callees.get(&callee)) {
            walk.add(callee);
        }
        walk
    }

    /// The longest walk through the function, or the cycles with a gain.
    fn run(&self) -> Result<Result<(Walk, i128), Vec<Walk>>> {
        let function = self.function;
        let mut best: Vec<Option<i128>> = vec![None; function.blocks.len()];
        let mut by: Vec<Option<usize>> = vec![None; function.blocks.len()];
        best[0] = Some(0);
        let order = order(function);
        loop {
            let mut is_changed = false;
            for &block in &order {
                let Some(here) = best[block] else { continue };
                for &edge in &function.blocks[block].out {
                    let Some(to) = function.edges[edge].to else { continue };
                    let there = here + self.gains[edge];
                    if best[to].is_none_or(|before| there > before) {
                        (best[to], by[to], is_changed) = (Some(there), Some(edge), true);
                    }
                }
            }
            if !is_changed {
                break;
            }
            let cycles = self.cycles(&by);
            if !cycles.is_empty() {
                return Ok(Err(cycles));
            }
        }
        let ends = function.edges.iter().enumerate().filter(|(_, edge)| edge.to.is_none());
        let last = ends
            .filter_map(|(number, edge)| Some((best[edge.from]? + self.gains[number], number)))
            .max();
        let Some((gain, last)) = last else {
            anyhow::bail!("{} has no end", function.name);
        };
        let mut walk = self.walk(last);
        let mut at = function.edges[last].from;
        while let Some(edge) = by[at] {
            walk.add(&self.walk(edge));
            at = function.edges[edge].from;
        }
        Ok(Ok((walk, gain)))
    }

    /// Cycles among the best incoming edges of the blocks: each of them has a gain.
    fn cycles(&self, by: &[Option<usize>]) -> Vec<Walk> {
        let mut seen = BTreeSet::new();
        let mut found = Vec::new();
        for start in 0..by.len() {
            let (mut path, mut at) = (Vec::new(), start);
            while seen.insert(at)
                && let Some(edge) = by[at]
            {
                path.push((at, edge));
                at = self.function.edges[edge].from;
            }
            if let Some(from) = path.iter().position(|&(block, _)| block == at) {
                let mut cycle = Walk::default();
                for &(_, edge) in &path[from..] {
                    cycle.add(&self.walk(edge));
                }
                cycle.through = self.function.blocks[at].instructions[0];
                found.push(cycle);
            }
        }
        found
    }
}

/// The blocks, each after most of its predecessors.
fn order(function: &Function) -> Vec<usize> {
    let (mut seen, mut order) = (vec![false; function.blocks.len()], Vec::new());
    let mut open = vec![(0, 0)];
    seen[0] = true;
    while let Some((block, next)) = open.pop() {
        match function.blocks[block].out.get(next) {
            Some(&edge) => {
                open.push((block, next + 1));
                if let Some(to) = function.edges[edge].to
                    && !seen[to]
                {
                    seen[to] = true;
                    open.push((to, 0));
                }
            }
            None => order.push(block),
        }
    }
    order.reverse();
    order
}

//! The natural loops of a function: each has one entry, which dominates its blocks.

use std::collections::BTreeSet;

use anyhow::{Result, ensure};

use super::graph::Function;

pub struct Loop {
    /// The block through which control enters.
    pub header: usize,
    pub blocks: BTreeSet<usize>,
    /// Edges back to the header.
    pub back: Vec<usize>,
    /// Edges to the header from outside.
    pub enter: Vec<usize>,
}

/// All loops. An irreducible loop is an error.
pub fn loops(function: &Function) -> Result<Vec<Loop>> {
    let dominators = dominators(function);
    let mut found: Vec<Loop> = Vec::new();
    let mut back = BTreeSet::new();
    for header in 0..function.blocks.len() {
        let into: Vec<usize> = function.into(header).collect();
        let (turns, enter): (Vec<_>, Vec<_>) = into
            .into_iter()
            .partition(|&edge| dominators[function.edges[edge].from].contains(&header));
        if turns.is_empty() {
            continue;
        }
        let mut blocks = BTreeSet::from([header]);
        let mut next: Vec<usize> = turns.iter().map(|&edge| function.edges[edge].from).collect();
        while let Some(block) = next.pop() {
            if blocks.insert(block) {
                next.extend(function.into(block).map(|edge| function.edges[edge].from));
            }
        }
        back.extend(turns.iter().copied());
        found.push(Loop { header, blocks, back: turns, enter });
    }
    ensure!(is_acyclic(function, &back), "{} has a loop with several entries", function.name);
    Ok(found)
}

/// The dominators of each block, including itself.
pub fn dominators(function: &Function) -> Vec<BTreeSet<usize>> {
    let all: BTreeSet<usize> = (0..function.blocks.len()).collect();
    let mut found = vec![all; function.blocks.len()];
    found[0] = BTreeSet::from([0]);
    let from: Vec<Vec<usize>> = (0..function.blocks.len())
        .map(|block| function.into(block).map(|edge| function.edges[edge].from).collect())
        .collect();
    loop {
        let mut is_changed = false;
        for block in 1..found.len() {
            let mut ways = from[block].iter().map(|&way| &found[way]);
            let first = ways.next().cloned().unwrap_or_default();
            let mut now = ways.fold(first, |both, way| &both & way);
            now.insert(block);
            if now != found[block] {
                (found[block], is_changed) = (now, true);
            }
        }
        if !is_changed {
            return found;
        }
    }
}

/// Whether the function's graph without these edges has no cycle.
fn is_acyclic(function: &Function, without: &BTreeSet<usize>) -> bool {
    let mut left: Vec<usize> = vec![0; function.blocks.len()];
    let kept = || function.edges.iter().enumerate().filter(|(n, _)| !without.contains(n));
    for (_, edge) in kept() {
        if let Some(to) = edge.to {
            left[to] += 1;
        }
    }
    let mut next: Vec<usize> = (0..left.len()).filter(|&block| left[block] == 0).collect();
    let mut seen = 0;
    while let Some(block) = next.pop() {
        seen += 1;
        for (_, edge) in kept().filter(|(_, edge)| edge.from == block) {
            if let Some(to) = edge.to {
                left[to] -= 1;
                if left[to] == 0 {
                    next.push(to);
                }
            }
        }
    }
    seen == left.len()
}

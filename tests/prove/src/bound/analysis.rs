//! A program prepared for a proof: its graph, its debug information, and the facts found in it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::facts::{Facts, Never, ONLY_FROM};
use super::graph::Program;
use super::image::Image;
use super::lines::{Lines, function_named};
use super::system::System;

/// A program with its facts.
pub struct Analysis {
    pub image: Image,
    pub program: Program,
    pub lines: Lines,
    pub system: System,
}

impl Analysis {
    /// Analyses the function whose own name contains `root`, and all functions below it. `source` is the repository.
    pub fn new(elf: &Path, source: &Path, root: &str, facts: &Facts) -> Result<Self> {
        let bytes = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
        let image = Image::read(&bytes)?;
        let root = function_named(elf, root, image.symbols().map(|(at, _)| at))?;
        let all = Program::read(&image, root, &BTreeSet::new())?;
        let program = Program::read(&image, root, &never(&all, facts.never)?)?;
        let functions = program.functions.values();
        let blocks = functions.flat_map(|function| &function.blocks);
        let places = blocks.flat_map(|block| block.instructions.iter().copied());
        let lines = Lines::read(elf, source, places)?;
        let system = System::new(&program, &image, &lines, facts.rows())?;
        Ok(Self { image, program, lines, system })
    }

    /// Instructions in the graph.
    pub fn instructions(&self) -> usize {
        let blocks = self.program.functions.values().flat_map(|function| &function.blocks);
        blocks.map(|block| block.instructions.len()).sum()
    }
}

/// Addresses of the calls that are never made.
fn never(program: &Program, all: &[Never]) -> Result<BTreeSet<u32>> {
    let mut places = BTreeSet::new();
    let mut is_found = vec![false; all.len()];
    let mut is_seen = vec![false; ONLY_FROM.len()];
    for function in program.functions.values() {
        for (block, callee) in function.calls() {
            let name = &program.functions[&callee].name;
            for ((caller, part, _), is_found) in all.iter().zip(&mut is_found) {
                if function.name.ends_with(caller) && name.contains(part) {
                    let from = &function.blocks[block];
                    let is_certain = from.out.len() == 1 && !from.is_call_conditional;
                    ensure!(is_certain, "{} may call {name}, or go on", function.name);
                    places.extend(function.blocks[block].instructions.last());
                    *is_found = true;
                }
            }
            for ((part, caller), is_seen) in ONLY_FROM.iter().zip(&mut is_seen) {
                *is_seen |= name.contains(part);
                let is_other = name.contains(part) && !function.name.contains(caller);
                ensure!(!is_other, "{} calls {name}", function.name);
            }
        }
    }
    for ((part, caller), is_seen) in ONLY_FROM.iter().zip(is_seen) {
        ensure!(is_seen, "no call to `{part}` is there, which only {caller} may make");
    }
    for ((caller, part, _), is_found) in all.iter().zip(is_found) {
        ensure!(is_found, "no call of `{caller}` to `{part}` is there to be left out");
    }
    Ok(places)
}

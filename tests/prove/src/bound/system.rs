//! Flow facts as inequalities between execution counts.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use super::decode::{half_word, may_write};
use super::facts::{Count, Fact, Most};
use super::graph::{Function, Program};
use super::image::Image;
use super::lines::{Lines, Within};
use super::loops::{Loop, dominators, loops};

/// A part of the program whose executions are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    Block(u32, usize),
    Edge(u32, usize),
}

/// A fact: a weighted sum of execution counts has an upper bound.
pub struct Row {
    pub name: &'static str,
    pub coefficients: BTreeMap<Part, i64>,
    pub most: Most,
}

/// The facts of a program, indexed by the parts that they count.
#[derive(Default)]
pub struct System {
    pub rows: Vec<Row>,
    of_part: BTreeMap<Part, Vec<(usize, i64)>>,
}

impl System {
    /// Locates the facts. A fact without a matching part is an error.
    pub fn new<'a>(
        program: &Program,
        image: &Image,
        lines: &Lines,
        facts: impl Iterator<Item = &'a Fact>,
    ) -> Result<Self> {
        let finder = Finder::new(program, image, lines)?;
        let mut system = Self::default();
        for fact in facts {
            let mut coefficients = BTreeMap::new();
            for (times, count) in fact.terms {
                let found = finder.parts(count).with_context(|| format!("fact `{}`", fact.name))?;
                for (part, weight) in found {
                    *coefficients.entry(part).or_default() += times * weight;
                }
            }
            system.add(Row { name: fact.name, coefficients, most: fact.most });
        }
        Ok(system)
    }

    /// Adds a fact.
    pub fn add(&mut self, row: Row) {
        let number = self.rows.len();
        for (&part, &times) in &row.coefficients {
            self.of_part.entry(part).or_default().push((number, times));
        }
        self.rows.push(row);
    }

    /// Lowers a fact's right side to a wrong one, which a trace must refute.
    pub fn narrow(&mut self, name: &str) {
        for row in self.rows.iter_mut().filter(|row| row.name == name) {
            row.coefficients.retain(|_, times| *times > 0);
        }
    }

    /// The facts that count a part, each with its coefficient.
    pub fn of(&self, part: Part) -> &[(usize, i64)] {
        self.of_part.get(&part).map(Vec::as_slice).unwrap_or_default()
    }
}

/// Locates the parts that a fact counts.
pub struct Finder<'a> {
    program: &'a Program,
    image: &'a Image,
    lines: &'a Lines,
    loops: BTreeMap<u32, Vec<Loop>>,
}

impl<'a> Finder<'a> {
    pub fn new(program: &'a Program, image: &'a Image, lines: &'a Lines) -> Result<Self> {
        let all = program.functions.iter().map(|(&at, function)| Ok((at, loops(function)?)));
        Ok(Self { program, image, lines, loops: all.collect::<Result<_>>()? })
    }

    /// The parts, each with the count of one execution.
    fn parts(&self, count: &Count) -> Result<Vec<(Part, i64)>> {
        let found = match count {
            Count::Passes(within) => each(self.blocks(within)?),
            Count::Calls(within, callee) => each(self.calls(within, callee)?),
            Count::Heads(within) => {
                let [outer, inner] = self.heads(within)?;
                let heads = outer.into_iter().map(|(at, own)| Part::Block(at, own.header));
                // Iterations that the compiler made a separate loop are counted in addition.
                let back = inner
                    .iter()
                    .flat_map(|(at, own)| own.back.iter().map(|&edge| Part::Edge(*at, edge)));
                each(heads.chain(back))
            }
            Count::Entries(within) => {
                let [heads, _] = self.heads(within)?;
                let edges = heads.iter().flat_map(|(at, own)| own.enter.iter().map(|&e| (*at, e)));
                each(edges.map(|(at, edge)| Part::Edge(at, edge)))
            }
            Count::Bytes(callee, register) => {
                let calls = self.calls(&[], callee)?.into_iter();
                let bytes = calls.map(|part| Ok((part, self.bytes(part, *register)?)));
                bytes.collect::<Result<_>>()?
            }
        };
        ensure!(!found.is_empty(), "nothing in the program matches {count:?}");
        Ok(found)
    }

    /// Blocks with an instruction in these frames, in the innermost loop that contains any; blocks that another one of
    /// the same loop dominates are left out.
    fn blocks(&self, within: &[Within]) -> Result<Vec<Part>> {
        let is_there = self.lines.all(within)?;
        let mut found = Vec::new();
        for (&at, function) in &self.program.functions {
            let has = |block: &usize| {
                function.blocks[*block].instructions.iter().any(|&place| is_there(place))
            };
            let around = |block: &usize| -> Vec<usize> {
                let around = self.loops[&at].iter().filter(|own| own.blocks.contains(block));
                around.map(|own| own.header).collect()
            };
            let mut all: Vec<usize> = (0..function.blocks.len()).filter(has).collect();
            let depths = all.iter().map(|block| around(block).len());
            let Some(deepest) = depths.max() else { continue };
            all.retain(|block| around(block).len() == deepest);
            let before = dominators(function);
            let is_first = |&&block: &&usize| {
                let is_before = |other: &usize| *other != block && before[block].contains(other);
                let own = around(&block);
                !all.iter().any(|other| is_before(other) && around(other) == own)
            };
            found.extend(all.iter().filter(is_first).map(|&block| Part::Block(at, block)));
        }
        Ok(found)
    }

    /// Blocks that end in a call, in these frames, of a function whose name contains this.
    pub fn calls(&self, within: &[Within], callee: &str) -> Result<Vec<Part>> {
        let is_there = self.lines.all(within)?;
        let is_it =
            |at: u32| self.program.functions.get(&at).is_some_and(|f| f.name.contains(callee));
        let mut found = Vec::new();
        for (&at, function) in &self.program.functions {
            for (number, block) in function.blocks.iter().enumerate() {
                let last = block.instructions.last().copied().unwrap_or_default();
                if block.call.is_some_and(is_it) && is_there(last) {
                    found.push(Part::Block(at, number));
                }
            }
            for (number, edge) in function.edges.iter().enumerate() {
                let last = function.blocks[edge.from].instructions.last().copied();
                if edge.tail.is_some_and(is_it) && is_there(last.unwrap_or_default()) {
                    found.push(Part::Edge(at, number));
                }
            }
        }
        Ok(found)
    }

    /// The loops whose header has an instruction in these frames: the outermost ones, and the others.
    fn heads(&self, within: &[Within]) -> Result<[Vec<(u32, &Loop)>; 2]> {
        let is_there = self.lines.all(within)?;
        let mut found = [Vec::new(), Vec::new()];
        for (&at, loops) in &self.loops {
            let function: &Function = &self.program.functions[&at];
            let has = |own: &&Loop| {
                function.blocks[own.header].instructions.iter().any(|&place| is_there(place))
            };
            let all: Vec<&Loop> = loops.iter().filter(has).collect();
            let is_within = |own: &Loop, other: &Loop| {
                own.header != other.header && other.blocks.contains(&own.header)
            };
            for own in &all {
                let is_inner = all.iter().any(|other| is_within(own, other));
                found[usize::from(is_inner)].push((at, *own));
            }
        }
        Ok(found)
    }

    /// The bytes that a call copies or clears: their number is in this register.
    fn bytes(&self, part: Part, register: u32) -> Result<i64> {
        let Part::Block(at, number) = part else { anyhow::bail!("copied by a jump") };
        let instructions = &self.program.functions[&at].blocks[number].instructions;
        length(self.image, instructions, register)
    }
}

/// The constant in a register, one of the lower eight, after these instructions, which end in a call.
///
/// # Errors
/// If they do not load a constant.
pub fn length(image: &Image, instructions: &[u32], register: u32) -> Result<i64> {
    let last = instructions.last().copied().unwrap_or_default();
    for (number, &place) in instructions.iter().enumerate().rev() {
        let is_conditional = is_under_it(image, &instructions[..number])?;
        let first = image.code(place)?;
        let is_wide = first >> 11 >= 0b11101;
        let second = if is_wide { image.code(place + 2)? } else { 0 };
        // MOVS; MOV.W with a byte; MOVW.
        match (first, second >> 8) {
            // In an IT block the length may or may not be loaded.
            _ if is_conditional && (place == last || may_write(register, first, second)) => break,
            _ if first >> 8 == 0x20 | register => return Ok(i64::from(first & 0xFF)),
            (0xF04F, to) if to == register => return Ok(i64::from(second & 0xFF)),
            (_, to) if first & 0xFBF0 == 0xF240 && to & 15 == register => {
                return Ok(i64::from(half_word(first, second)));
            }
            // The call itself writes no register.
            _ if place != last && may_write(register, first, second) => break,
            _ => {}
        }
    }
    let start = instructions.first().copied().unwrap_or_default();
    anyhow::bail!("the length that is copied at {start:#x} is no constant")
}

/// Whether the instruction after these is in an IT block, which contains one to four instructions.
fn is_under_it(image: &Image, before: &[u32]) -> Result<bool> {
    for (behind, &place) in (1..=4).zip(before.iter().rev()) {
        let code = image.code(place)?;
        if code >> 8 == 0xBF && code & 15 != 0 {
            return Ok(behind <= 4 - (code & 15).trailing_zeros());
        }
    }
    Ok(false)
}

fn each(parts: impl IntoIterator<Item = Part>) -> Vec<(Part, i64)> {
    parts.into_iter().map(|part| (part, 1)).collect()
}

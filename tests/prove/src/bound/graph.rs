//! The control flow graph of a function, and of all functions that it calls.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail, ensure};

use super::decode::{Flow, Instruction, decode, long_branch};
use super::image::Image;

/// A basic block: consecutive instructions, of which only the last may branch or call.
pub struct Block {
    /// Addresses of its instructions.
    pub instructions: Vec<u32>,
    /// The function that its last instruction calls.
    pub call: Option<u32>,
    /// Whether the call depends on a condition of an IT block.
    pub is_call_conditional: bool,
    /// Its outgoing edges.
    pub out: Vec<usize>,
}

/// An outgoing edge of a block.
pub struct Edge {
    pub from: usize,
    /// The target block; `None` for the function's end.
    pub to: Option<usize>,
    /// The function that a tail branch leads to.
    pub tail: Option<u32>,
}

pub struct Function {
    pub start: u32,
    pub name: String,
    /// The first is the function's entry.
    pub blocks: Vec<Block>,
    pub edges: Vec<Edge>,
}

impl Function {
    /// The blocks that end in a call of a function, or in a branch to it, and the function.
    pub fn calls(&self) -> impl Iterator<Item = (usize, u32)> {
        let blocks = self.blocks.iter().enumerate();
        let calls = blocks.filter_map(|(number, block)| Some((number, block.call?)));
        calls.chain(self.edges.iter().filter_map(|edge| Some((edge.from, edge.tail?))))
    }

    /// Functions that it calls.
    pub fn callees(&self) -> impl Iterator<Item = u32> {
        self.calls().map(|(_, callee)| callee)
    }

    /// The predecessors of a block.
    pub fn into(&self, block: usize) -> impl Iterator<Item = usize> {
        let all = self.edges.iter().enumerate();
        all.filter(move |(_, edge)| edge.to == Some(block)).map(|(number, _)| number)
    }
}

/// An instruction, and its possible successors.
struct Step {
    instruction: Instruction,
    is_conditional: bool,
    next: Vec<u32>,
    /// Whether the function may end here.
    is_end: bool,
    call: Option<u32>,
    tail: Option<u32>,
}

/// Builds a function's graph from the instructions that are reachable from its entry. No control flow reaches an
/// address in `never`.
pub fn function(image: &Image, start: u32, never: &BTreeSet<u32>) -> Result<Function> {
    let symbol = image.symbol(start)?;
    let name = symbol.name.clone();
    let steps = steps(image, start, symbol.end, never)?;
    let mut leaders = BTreeSet::from([start]);
    let mut arrivals: BTreeMap<u32, u32> = BTreeMap::new();
    for (&at, step) in &steps {
        let after = at + step.instruction.bytes;
        let falls = step.next == [after] && step.call.is_none() && !step.is_end;
        for &next in &step.next {
            *arrivals.entry(next).or_default() += 1;
            if !falls || arrivals[&next] > 1 {
                leaders.insert(next);
            }
        }
    }
    let number: BTreeMap<u32, usize> = leaders.iter().enumerate().map(|(n, &at)| (at, n)).collect();
    let (mut blocks, mut edges) = (Vec::new(), Vec::new());
    for &leader in &leaders {
        let from = blocks.len();
        let (mut at, mut instructions) = (leader, Vec::new());
        let last = loop {
            instructions.push(at);
            let step = &steps[&at];
            match *step.next.as_slice() {
                [next] if !leaders.contains(&next) => at = next,
                _ => break step,
            }
        };
        let first = edges.len();
        edges.extend(last.next.iter().map(|next| Edge {
            from,
            to: Some(number[next]),
            tail: None,
        }));
        if last.is_end {
            edges.push(Edge { from, to: None, tail: last.tail });
        }
        blocks.push(Block {
            instructions,
            call: last.call,
            is_call_conditional: last.is_conditional,
            out: (first..edges.len()).collect(),
        });
    }
    Ok(Function { start, name, blocks, edges })
}

fn steps(
    image: &Image,
    start: u32,
    end: u32,
    never: &BTreeSet<u32>,
) -> Result<BTreeMap<u32, Step>> {
    let mut steps: BTreeMap<u32, Step> = BTreeMap::new();
    let halves = [0, 2, 4, 6, 8].map(|offset| image.code(start + offset).unwrap_or_default());
    let far = long_branch(halves);
    // Addresses to decode, each with the number of conditional instructions from there on.
    let mut places = vec![(start, 0)];
    while let Some((at, conditional)) = places.pop() {
        if steps.contains_key(&at) {
            continue;
        }
        ensure!((start..end).contains(&at), "control leaves the function at {start:#x} to {at:#x}");
        let first = image.code(at)?;
        let second = if first >> 11 >= 0b11101 { image.code(at + 2)? } else { 0 };
        let instruction = decode(at, first, second);
        let after = at + instruction.bytes;
        let is_conditional = conditional > 0;
        let mut left = u32::saturating_sub(conditional, 1);
        let mut step = Step {
            instruction,
            is_conditional,
            next: if is_conditional { vec![after] } else { Vec::new() },
            is_end: false,
            call: None,
            tail: None,
        };
        match instruction.flow {
            Flow::Next => step.next = vec![after],
            Flow::Conditions(count) => {
                left = count;
                step.next = vec![after];
            }
            Flow::Call(target) => {
                step.call = Some(target);
                step.next = vec![after];
            }
            Flow::Branch(target) | Flow::Jump(target) => {
                if matches!(instruction.flow, Flow::Branch(_)) && !is_conditional {
                    step.next.push(after);
                }
                if (start..end).contains(&target) {
                    step.next.push(target);
                } else {
                    (step.is_end, step.tail) = (true, Some(target));
                }
            }
            Flow::Return | Flow::Trap => step.is_end = true,
            Flow::Table(bytes) => step.next = table(image, after, bytes, start..end)?,
            Flow::Indirect if far.is_some() => (step.is_end, step.tail) = (true, far),
            Flow::Indirect => bail!("the branch at {at:#x} leads to an address in a register"),
        }
        step.next.sort_unstable();
        step.next.dedup();
        step.next.retain(|next| !never.contains(next));
        places.extend(step.next.iter().map(|&next| (next, if next == after { left } else { 0 })));
        steps.insert(at, step);
    }
    Ok(steps)
}

/// The targets in a jump table.
fn table(image: &Image, at: u32, bytes: u32, function: std::ops::Range<u32>) -> Result<Vec<u32>> {
    let count = (image.end_of_data(at - 1).max(image.end_of_data(at)) - at) / bytes;
    let mut places = Vec::new();
    for entry in image.bytes(at, count * bytes)?.chunks_exact(bytes as usize) {
        let offset = entry.iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte));
        // A table of bytes is padded to a half word.
        let target = at + 2 * offset;
        if offset > 0 {
            ensure!(function.contains(&target), "a table at {at:#x} leads to {target:#x}");
            places.push(target);
        }
    }
    Ok(places)
}

/// A function and all functions that it calls, by address.
pub struct Program {
    pub root: u32,
    pub functions: BTreeMap<u32, Function>,
    /// Callees before their callers.
    pub order: Vec<u32>,
}

impl Program {
    /// The number of its blocks.
    pub fn blocks(&self) -> usize {
        self.functions.values().map(|function| function.blocks.len()).sum()
    }

    /// Builds the graphs of the functions below `root`. No control flow reaches an address in `never`.
    pub fn read(image: &Image, root: u32, never: &BTreeSet<u32>) -> Result<Self> {
        let mut program = Self { root, functions: BTreeMap::new(), order: Vec::new() };
        program.add(image, root, never, &mut Vec::new())?;
        Ok(program)
    }

    fn add(
        &mut self,
        image: &Image,
        at: u32,
        never: &BTreeSet<u32>,
        above: &mut Vec<u32>,
    ) -> Result<()> {
        ensure!(!above.contains(&at), "recursion through the function at {at:#x}");
        if self.functions.contains_key(&at) {
            return Ok(());
        }
        let function = function(image, at, never)?;
        above.push(at);
        for callee in function.callees().collect::<BTreeSet<_>>() {
            self.add(image, callee, never, above)?;
        }
        above.pop();
        self.functions.insert(at, function);
        self.order.push(at);
        Ok(())
    }
}

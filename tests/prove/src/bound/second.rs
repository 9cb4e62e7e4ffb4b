//! An independent decoder: GNU's `objdump` must decode each instruction of the graph as ours does.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use xtask::apt;
use xtask::process::quiet;

use super::analysis::Analysis;
use super::decode::{Flow, decode};

const PROGRAM: &str = "arm-none-eabi-objdump";
const PACKAGE: &str = "binutils-arm-none-eabi";
const PATIENCE: Duration = Duration::from_secs(60);
const CONDITIONS: [&str; 14] =
    ["eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le"];

/// The instructions of a program, by address, as the other decoder prints them.
pub struct Listing(BTreeMap<u32, String>);

impl Listing {
    pub fn read(elf: &Path) -> Result<Self> {
        let version = || quiet(Command::new(PROGRAM).arg("--version"), PATIENCE);
        version().or_else(|_| apt::install(&[PACKAGE]).and_then(|()| version()))?;
        let mut decoder = Command::new(PROGRAM);
        let text = quiet(decoder.args(["-d", "--no-show-raw-insn"]).arg(elf), PATIENCE)?;
        Ok(Self(text.lines().filter_map(line).collect()))
    }

    pub fn at(&self, at: u32) -> Result<&str> {
        let text = self.0.get(&at).with_context(|| format!("{PROGRAM} has nothing at {at:#x}"))?;
        Ok(text)
    }
}

/// Compares the instructions of a graph with those of the other decoder. Returns their number.
pub fn agree(analysis: &Analysis, listing: &Listing) -> Result<usize> {
    let functions = analysis.program.functions.values();
    let blocks = functions.flat_map(|function| &function.blocks);
    let mut count = 0;
    for &at in blocks.flat_map(|block| &block.instructions) {
        let first = analysis.image.code(at)?;
        let second = if first >> 11 >= 0b11101 { analysis.image.code(at + 2)? } else { 0 };
        let ours = decode(at, first, second);
        let theirs = listing.at(at)?;
        ensure!(
            is_same(ours.flow, flow(theirs)?),
            "{at:#x} is `{theirs}` for {PROGRAM}, and {:?} here",
            ours.flow
        );
        // No instruction may start within another.
        let inside = listing.0.range(at + 1..at + ours.bytes).next();
        ensure!(inside.is_none(), "{at:#x} is shorter for {PROGRAM}");
        count += 1;
    }
    Ok(count)
}

/// Parses a line such as `   691a8:\tsubs\tr2, #16`.
fn line(text: &str) -> Option<(u32, String)> {
    let (at, rest) = text.split_once(":\t")?;
    Some((u32::from_str_radix(at.trim(), 16).ok()?, rest.to_owned()))
}

/// A conditional branch of an IT block has the encoding of an unconditional one.
fn is_same(ours: Flow, theirs: Flow) -> bool {
    let ours = if let (Flow::Jump(to), Flow::Branch(_)) = (ours, theirs) {
        Flow::Branch(to)
    } else {
        ours
    };
    ours == theirs
}

pub(super) fn flow(text: &str) -> Result<Flow> {
    let (name, operands) = text.split_once('\t').unwrap_or((text, ""));
    let name = name.trim_end_matches(".n").trim_end_matches(".w");
    let condition = CONDITIONS.into_iter().find_map(|condition| name.strip_suffix(condition));
    let target = |place: usize| {
        let word = operands.split(", ").nth(place).and_then(|word| word.split_whitespace().next());
        let word = word.with_context(|| format!("no target in `{text}`"))?;
        u32::from_str_radix(word, 16).with_context(|| format!("no target in `{text}`"))
    };
    let to_caller =
        operands == "lr" || operands.contains("pc}") || operands.starts_with("pc, [sp]");
    Ok(match (name, condition) {
        ("bl", _) => Flow::Call(target(0)?),
        ("b", _) => Flow::Jump(target(0)?),
        (_, Some("b")) => Flow::Branch(target(0)?),
        ("cbz" | "cbnz", _) => Flow::Branch(target(1)?),
        ("tbb", _) => Flow::Table(1),
        ("tbh", _) => Flow::Table(2),
        ("udf", _) => Flow::Trap,
        ("bx" | "pop" | "ldmia" | "ldr", _) | (_, Some("bx" | "pop" | "ldmia" | "ldr"))
            if to_caller =>
        {
            Flow::Return
        }
        ("bx" | "blx" | "svc", _) => Flow::Indirect,
        ("ldr" | "mov" | "add", _) if operands.starts_with("pc,") => Flow::Indirect,
        _ if name.starts_with("it") && name.chars().all(|one| "ite".contains(one)) => {
            Flow::Conditions(name.len() as u32 - 1)
        }
        _ => Flow::Next,
    })
}

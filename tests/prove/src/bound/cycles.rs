//! A model of the cycles of a Cortex-M7, beside the instructions that are proven. An instruction takes at least the latency
//! that LLVM's scheduling model of this processor states (`ARMScheduleM7.td`), and one cycle more where it needs an operand
//! early, as if none overlapped with another although the processor can issue two at a time, and no branch is predicted.
//! Memory answers at once: no cache, no wait states.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use super::analysis::Analysis;
use super::decode::Flow;
use super::second::{Listing, flow};

/// Cycles of a branch, and those that a wrong prediction adds: by the model's comment on forward branches, where it
/// schedules with four.
const BRANCH: i64 = 2;
const MISPREDICTED: i64 = 6;

/// An address is needed a stage before the operands of arithmetic, and so are shifted operands.
const EARLY: i64 = 1;

/// Latencies by how a mnemonic starts; the first that fits.
const LATENCIES: &[(&str, i64)] = &[
    ("vdiv", 16),
    ("vsqrt", 16),
    ("vfma", 6),
    ("vfms", 6),
    ("vfnm", 6),
    ("vmla", 6),
    ("vmls", 6),
    ("vnml", 6),
    ("vldr", 1 + EARLY),
    ("vstr", 1 + EARLY),
    ("vadd", 3),
    ("vsub", 3),
    ("vmul", 3),
    ("vnmul", 3),
    ("vneg", 3),
    ("vabs", 3),
    ("vcmp", 3),
    ("vcvt", 3),
    ("vmov", 3),
    ("vmrs", 3),
    ("vmsr", 3),
    ("vsel", 3 + EARLY),
    ("vmax", 3),
    ("vmin", 3),
    ("vrint", 3),
    ("sdiv", 7),
    ("udiv", 7),
    ("mul", 2),
    ("mla", 2),
    ("mls", 2),
    ("smu", 2),
    ("smla", 2),
    ("smml", 2),
    ("smmu", 2),
    ("umu", 2),
    ("umla", 2),
    ("umaa", 2),
    ("ldrb", 2 + EARLY),
    ("ldrh", 2 + EARLY),
    ("ldrs", 2 + EARLY),
    ("ldrex", 2 + EARLY),
    ("ldr", 1 + EARLY),
    ("str", 2 + EARLY),
    ("dmb", 3),
    ("dsb", 3),
    ("isb", 3),
    ("mrs", 3),
    ("msr", 3),
    ("clrex", 3),
    ("ssat", 2 + EARLY),
    ("usat", 2 + EARLY),
    ("bfi", 1 + EARLY),
    ("bfc", 1 + EARLY),
    ("sbfx", 1 + EARLY),
    ("ubfx", 1 + EARLY),
    ("pkh", 1 + EARLY),
    ("uxta", 1 + EARLY),
    ("sxta", 1 + EARLY),
    ("uq", 2),
    ("nop", 3),
];

/// Arithmetic of one cycle, by how a mnemonic starts.
const ARITHMETIC: &[&str] = &[
    "adc", "add", "adr", "and", "asr", "bic", "clz", "cmn", "cmp", "eor", "it", "lsl", "lsr",
    "mov", "mvn", "neg", "orn", "orr", "rbit", "rev", "ror", "rrx", "rsb", "sbc", "sel", "sub",
    "sxt", "teq", "tst", "uadd", "uxt",
];

/// Operands that are shifted first.
const SHIFTS: &[&str] = &[", lsl", ", lsr", ", asr", ", ror", ", rrx"];

/// The cycles of each instruction of a graph.
pub struct Cycles(BTreeMap<u32, i64>);

impl Cycles {
    pub fn new(analysis: &Analysis, listing: &Listing) -> Result<Self> {
        let functions = analysis.program.functions.values();
        let places = functions.flat_map(|function| &function.blocks);
        let cycles = places.flat_map(|block| &block.instructions).map(|&at| {
            let text = listing.at(at)?;
            Ok((at, cycles(text).with_context(|| format!("{at:#x}"))?))
        });
        Ok(Self(cycles.collect::<Result<_>>()?))
    }

    /// Those of the instruction at this address.
    pub fn at(&self, at: u32) -> i64 {
        self.0[&at]
    }
}

/// The cycles of an instruction, as a disassembler prints it.
pub fn cycles(text: &str) -> Result<i64> {
    let (name, operands) = text.split_once('\t').unwrap_or((text, ""));
    ensure!(!name.contains(".f64"), "no latency of `{text}`");
    let branch = match flow(text)? {
        Flow::Next | Flow::Conditions(_) => 0,
        _ => BRANCH + MISPREDICTED,
    };
    // One for each word, though two may come at a time.
    if let Some((_, list)) = operands.split_once('{') {
        let is_stored = ["st", "push", "vst", "vpush"].iter().any(|start| name.starts_with(start));
        return Ok(branch + EARLY + i64::from(is_stored) + words(list.trim_end_matches('}')));
    }
    if branch > 0 {
        let is_loaded = name.starts_with("tb") || name.starts_with("ldr");
        return Ok(branch + if is_loaded { 2 + EARLY } else { 0 });
    }
    // `ldrhi` may be a word under a condition, and counts as the half word that it may also be.
    if let Some((_, latency)) = LATENCIES.iter().find(|(start, _)| name.starts_with(start)) {
        let is_pair = ["ldrd", "strd"].iter().any(|start| name.starts_with(start))
            || ["vldr", "vstr"].iter().any(|start| name.starts_with(start))
                && operands.starts_with('d');
        return Ok(latency + i64::from(is_pair));
    }
    let is_known = ARITHMETIC.iter().any(|start| name.starts_with(start));
    ensure!(is_known, "no latency of `{text}`");
    let is_shifted = SHIFTS.iter().any(|by| operands.contains(by));
    Ok(1 + if is_shifted { EARLY } else { 0 })
}

/// The words of registers in a list such as `r4, r6, pc` or `d8-d15`.
fn words(list: &str) -> i64 {
    let number = |name: &str| name.trim_start_matches(['r', 's', 'd']).parse::<i64>().unwrap_or(0);
    let parts = list.split(", ").map(|part| {
        let of_each = if part.starts_with('d') { 2 } else { 1 };
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        of_each * (number(last) - number(first) + 1)
    });
    parts.sum()
}

//! The deepest stack, computed from the binary alone: from every function's frame and the call graph.
//!
//! Frame sizes come from the compiler's `.stack_sizes`, if the build has them, and from the instructions that move the
//! stack pointer; the larger one counts. Calls come from the branch instructions. Encodings are those of the ARMv7-M
//! Architecture Reference Manual, A5 and A7. Branches to an address in a register cannot be followed and are listed; in
//! the control path they are an error, as is recursion anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use crate::bound::decode::{far, long_branch, near, signed};

/// Stack of an exception's entry: 26 words with the FPU's registers, plus alignment.
pub const EXCEPTION_FRAME: u32 = 26 * 4 + 8;

#[derive(Default)]
struct Function {
    name: String,
    frame: u32,
    /// Targets of branches out of it, each with the addresses of the branches.
    calls: BTreeMap<u32, Vec<u32>>,
    /// Number of branches to an address in a register.
    indirect: u32,
}

/// The call graph of a binary: functions by address.
pub struct Binary {
    functions: BTreeMap<u32, Function>,
    vectors: Vec<u32>,
    /// Size of the stack: bytes between two symbols of the linker.
    pub stack_room: u32,
    /// Functions that mask interrupts.
    pub masking: Vec<String>,
}

/// The worst case.
pub struct Worst {
    /// Start-up and the idle loop.
    pub idle: u32,
    /// Bus reception.
    pub bus: u32,
    /// The control tick.
    pub control: u32,
    /// The three levels on top of each other, with an exception entry between them, and a fault.
    pub total: u32,
}

impl Binary {
    pub fn read(program: &Path) -> Result<Self> {
        let bytes = fs::read(program)
            .with_context(|| format!("cannot read the firmware {}", program.display()))?;
        let file = object::File::parse(&*bytes)?;
        let mut functions = BTreeMap::new();
        let mut masking = BTreeSet::new();
        // The starts of code and of data, from the linker's mapping symbols.
        let marks: BTreeMap<u32, bool> = file
            .symbols()
            .filter_map(|symbol| {
                let name = symbol.name().ok()?;
                let is_code = name.starts_with("$t");
                let is_mark = is_code || name.starts_with("$d");
                is_mark.then_some((symbol.address() as u32, is_code))
            })
            .collect();
        for section in file.sections() {
            let (base, code) = (section.address() as u32, section.data()?);
            for symbol in file.symbols().filter(|s| s.section_index() == Some(section.index())) {
                if symbol.kind() != SymbolKind::Text || symbol.size() == 0 {
                    continue;
                }
                let start = symbol.address() as u32 & !1;
                let from = (start - base) as usize;
                let body = code.get(from..from + symbol.size() as usize).unwrap_or_default();
                let name = format!("{:#}", rustc_demangle::demangle(symbol.name()?));
                let mut function = Function { name, ..Function::default() };
                decode(start, body, &marks, &mut function, &mut masking);
                functions.insert(start, function);
            }
        }
        let (mut found, mut larger) = (0, 0);
        for (address, size) in declared(&file)? {
            if let Some(function) = functions.get_mut(&(address & !1)) {
                found += 1;
                larger += u32::from(size > function.frame);
                function.frame = function.frame.max(size);
            }
        }
        println!("frames that the compiler tells: {found}, of them larger than decoded: {larger}");
        let vectors = file.section_by_name(".vector_table").context("no vector table")?;
        let vectors = vectors.data()?.chunks_exact(4).skip(1);
        let vectors = vectors.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) & !1).collect();
        let mark = |name: &str| {
            let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
            symbol.map(|symbol| symbol.address() as u32).with_context(|| format!("no {name}"))
        };
        let stack_room = mark("_stack_start")? - mark("_stack_end")?;
        Ok(Self { functions, vectors, stack_room, masking: masking.into_iter().collect() })
    }

    /// The deepest stack of the three levels and a fault on top of them.
    pub fn worst(&self) -> Result<Worst> {
        // Vectors after the initial stack pointer: reset, NMI, hard fault, ...; SysTick is the 15th,
        // the bus the first interrupt.
        for root in [self.handler(16)?, self.handler(15)?] {
            let indirect = self.indirect(root);
            ensure!(
                indirect.is_empty(),
                "the control path calls through a register: {}",
                indirect.join(", ")
            );
        }
        let fault = self.depth(3)?;
        let (idle, bus, control) = (self.depth(1)?, self.depth(16)?, self.depth(15)?);
        let total = idle + bus + control + fault + 3 * EXCEPTION_FRAME;
        Ok(Worst { idle, bus, control, total })
    }

    /// The handler of an exception, by number: `SysTick` is the 15th.
    pub fn handler(&self, exception: usize) -> Result<u32> {
        self.vectors.get(exception - 1).copied().context("vector missing")
    }

    /// The number of the exception whose handler has this name.
    pub fn exception(&self, name: &str) -> Result<usize> {
        let place = self.vectors.iter().position(|&vector| self.name(vector) == Some(name));
        Ok(place.with_context(|| format!("no vector leads to {name}"))? + 1)
    }

    pub fn name(&self, address: u32) -> Option<&str> {
        self.functions.get(&address).map(|function| &*function.name)
    }

    /// Functions below `root` in the call graph, including `root`, by address.
    pub fn below(&self, root: u32) -> BTreeSet<u32> {
        self.below_but(root, |_| false)
    }

    /// The same without the functions that are left out, and those that only they call.
    pub fn below_but(&self, root: u32, is_left_out: impl Fn(u32) -> bool) -> BTreeSet<u32> {
        let mut seen = BTreeSet::from([root]);
        let mut next = vec![root];
        while let Some(function) = next.pop().and_then(|address| self.functions.get(&address)) {
            let calls = function.calls.keys();
            next.extend(calls.filter(|&&call| !is_left_out(call) && seen.insert(call)));
        }
        seen
    }

    /// The deepest stack of an exception's handler, by its number.
    pub fn depth(&self, exception: usize) -> Result<u32> {
        self.deepest(self.handler(exception)?, &mut Vec::new())
    }

    /// Functions below `root` that contain branches to an address in a register.
    pub fn indirect(&self, root: u32) -> Vec<String> {
        let below = self.below(root);
        let functions = below.iter().filter_map(|address| self.functions.get(address));
        let found = functions.filter(|function| function.indirect > 0);
        found.map(|function| function.name.clone()).collect()
    }

    /// Functions that panic: the handler, and functions of `core` that call it.
    pub fn panicking(&self) -> BTreeSet<u32> {
        let is_start = |name: &str| name.contains("begin_unwind") || name.contains("panicking::");
        let named = self.functions.iter().filter(|(_, function)| is_start(&function.name));
        let mut found: BTreeSet<u32> = named.map(|(&address, _)| address).collect();
        loop {
            let leads = |function: &Function| function.calls.keys().any(|c| found.contains(c));
            let more = self.functions.iter().filter(|(address, function)| {
                function.name.starts_with("core::") && !found.contains(address) && leads(function)
            });
            let more: Vec<u32> = more.map(|(&address, _)| address).collect();
            if more.is_empty() {
                return found;
            }
            found.extend(more);
        }
    }

    /// Addresses of branches to one of these functions from any other function.
    pub fn branches_to(&self, targets: &BTreeSet<u32>) -> Vec<u32> {
        let others = self.functions.iter().filter(|(address, _)| !targets.contains(address));
        let calls = others.flat_map(|(_, function)| &function.calls);
        let wanted = calls.filter(|(target, _)| targets.contains(target));
        wanted.flat_map(|(_, places)| places).copied().collect()
    }

    /// Indirect calls in start-up code and the idle loop.
    pub fn indirect_when_idle(&self) -> Vec<String> {
        self.vectors.first().map(|&reset| self.indirect(reset)).unwrap_or_default()
    }

    fn deepest(&self, address: u32, above: &mut Vec<u32>) -> Result<u32> {
        let Some(function) = self.functions.get(&address) else {
            bail!("a call leads to {address:#x}, where no function starts");
        };
        ensure!(!above.contains(&address), "recursion through {}", function.name);
        above.push(address);
        let mut below = 0;
        for &call in function.calls.keys() {
            below = below.max(self.deepest(call, above)?);
        }
        above.pop();
        Ok(function.frame + below)
    }
}

/// Addresses and frame sizes from the compiler.
fn declared(file: &object::File<'_>) -> Result<Vec<(u32, u32)>> {
    let mut sizes = Vec::new();
    for section in file.sections().filter(|s| s.name() == Ok(".stack_sizes")) {
        let mut rest = section.data()?;
        while let Some((address, after)) = rest.split_first_chunk::<4>() {
            rest = after;
            let mut size = 0_u32;
            for shift in (0..32).step_by(7) {
                let (&byte, after) = rest.split_first().context(".stack_sizes is cut off")?;
                rest = after;
                size |= u32::from(byte & 0x7F) << shift;
                if byte & 0x80 == 0 {
                    break;
                }
            }
            sizes.push((u32::from_le_bytes(*address), size));
        }
    }
    Ok(sizes)
}

/// Reads a function's instructions: those that move the stack pointer, and branches out of the function.
fn decode(
    start: u32,
    body: &[u8],
    marks: &BTreeMap<u32, bool>,
    function: &mut Function,
    masking: &mut BTreeSet<String>,
) {
    let end = start + body.len() as u32;
    let half = |address: u32| {
        let at = (address - start) as usize;
        body.get(at..at + 2).map_or(0, |b| u32::from(u16::from_le_bytes([b[0], b[1]])))
    };
    if let Some(target) = long_branch([0, 2, 4, 6, 8].map(|offset| half(start + offset))) {
        function.calls.entry(target).or_default().push(start);
        return;
    }
    let mut at = start;
    while at + 1 < end {
        if marks.range(..=at).next_back().is_some_and(|(_, &is_code)| !is_code) {
            at += 2;
            continue;
        }
        let first = half(at);
        let is_wide = first >> 11 >= 0b11101;
        let mut leave = |target: u32, is_call: bool| {
            if is_call || target < start || target >= end {
                function.calls.entry(target).or_default().push(at);
            }
        };
        if is_wide {
            let second = half(at + 2);
            match (first >> 11, second >> 14, second >> 12 & 1) {
                // BL, and B.W (T4).
                (0b11110, 0b11, 1) => leave(far(at, first, second), true),
                (0b11110, 0b10, 1) => leave(far(at, first, second), false),
                // B.W under a condition (T3).
                (0b11110, 0b10, 0) if first >> 7 & 7 != 7 => leave(near(at, first, second), false),
                _ => {}
            }
            function.frame += wide_push(first, second);
            // LDR pc; from the stack it is a return.
            if first & 0xFF70 == 0xF850 && second >> 12 == 15 && first & 15 != 13 {
                function.indirect += 1;
            }
            // MSR to PRIMASK, BASEPRI or FAULTMASK.
            if first & 0xFFF0 == 0xF380 && second & 0xFF00 == 0x8800 && second & 0xFF >= 16 {
                masking.insert(function.name.clone());
            }
        } else {
            match first {
                // BLX, and BX unless it is a return.
                _ if first & 0xFF80 == 0x4780 => function.indirect += 1,
                _ if first & 0xFF80 == 0x4700 && first >> 3 & 15 != 14 => function.indirect += 1,
                // MOV pc, and ADD pc.
                _ if first & 0xFF87 == 0x4687 || first & 0xFF87 == 0x4487 => function.indirect += 1,
                // B (T2), and under a condition (T1).
                _ if first >> 11 == 0b11100 => {
                    leave(at.wrapping_add(4).wrapping_add(signed(first << 1, 12)), false);
                }
                _ if first >> 12 == 0b1101 && first >> 9 & 7 != 7 => {
                    leave(at.wrapping_add(4).wrapping_add(signed((first & 0xFF) << 1, 9)), false);
                }
                // PUSH, SUB sp, CPSID.
                _ if first & 0xFE00 == 0xB400 => {
                    function.frame += 4 * ((first & 0x1FF).count_ones());
                }
                _ if first & 0xFF80 == 0xB080 => function.frame += 4 * (first & 0x7F),
                _ if first & 0xFFF0 == 0xB670 => {
                    masking.insert(function.name.clone());
                }
                _ => {}
            }
        }
        at += if is_wide { 4 } else { 2 };
    }
}

/// Bytes by which a 32-bit instruction lowers the stack pointer.
fn wide_push(first: u32, second: u32) -> u32 {
    match first {
        // STMDB sp!, and STR [sp, #-n]!
        0xE92D => 4 * second.count_ones(),
        0xF84D if second & 0x0F00 == 0x0D00 => second & 0xFF,
        // VPUSH.
        0xED2D => 4 * (second & 0xFF),
        // SUBW sp, and SUB.W sp with a modified constant.
        0xF2AD | 0xF6AD => (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF,
        0xF1AD | 0xF5AD if second >> 8 & 15 == 13 => {
            expand((first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF)
        }
        _ => 0,
    }
}

/// A modified constant (A5.3.2).
fn expand(constant: u32) -> u32 {
    let byte = constant & 0xFF;
    match constant >> 8 {
        0 => byte,
        1 => byte | byte << 16,
        2 => byte << 8 | byte << 24,
        3 => byte | byte << 8 | byte << 16 | byte << 24,
        _ => (0x80 | constant & 0x7F).rotate_right(constant >> 7),
    }
}

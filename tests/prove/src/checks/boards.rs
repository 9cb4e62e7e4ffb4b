//! The controller for real boards: it builds, and its parts are in the memories that docs/boards.md states.
//!
//! One file, because the measurements and their limits belong together.

// Requirements: P-01, P-02, P-10

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use addr2line::Loader;
use anyhow::{Context, Result, anyhow, ensure};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf};
use xtask::process::run;
use xtask::steps::Outcome;
use xtask::toolchain::Cross;

use crate::binary::{Binary, EXCEPTION_FRAME};
use crate::footprint::Footprint;
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FAULTS, MEMORY, RESOURCES, TIMING},
    note,
};
use crate::harness::{Check, Effort, record};

pub const CHECK: Check = Check {
    name: "controller on an STM32H743",
    run: check,
    promises: &[
        note("h743.tick.functions"),
        Promise {
            id: "h743.tick.outside",
            says: "The control tick on an STM32H743 runs from the instruction TCM, but for what few ticks call",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {h743.tick.functions} functions below its vector, in two programs, are elsewhere",
            limits: "By the binaries' branches, over Ethernet and over FDCAN. It never ran on silicon. In flash are: sides that \
                     f32 cannot tell, normals next to contact, unclear pairs of axis and triangle, a second solid or \
                     surface, the start of a search from the root, a tick without a side, and errors.",
        },
        Promise {
            id: "h743.tick.panics",
            says: "It has no panic path, and calls nothing through a register",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "functions below its vector",
            limits: "",
        },
        Promise {
            id: "h743.misplaced",
            says: "Frames in the AXI SRAM, the tick's state in the data TCM, the tree in flash, DMA's memory not cached",
            criterion: MEMORY,
            bound: Bound::Is(0.0),
            unit: "of these elsewhere",
            limits: "By the binaries' symbols.",
        },
        Promise {
            id: "h743.panics",
            says: "Panic paths in the controller's own code, the library included",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "branches",
            limits: "The drivers have some: docs/boards.md.",
        },
        note("h743.panics.ethernet"),
        note("h743.panics.fdcan"),
        note("h743.panics.places"),
        Promise {
            id: "h743.allocators",
            says: "No allocator in it",
            criterion: RESOURCES,
            bound: Bound::Is(0.0),
            unit: "allocator symbols",
            limits: "",
        },
        Promise {
            id: "h743.stack",
            says: "Its stack at the worst: idle loop, a bus's interrupt and the control tick on top of each other",
            criterion: MEMORY,
            bound: Bound::NotAbove("h743.stack.room"),
            unit: "bytes",
            limits: "By the instructions; calls through a register, of which the drivers have some, are not followed.",
        },
        note("h743.stack.room"),
        note("h743.itcm"),
        note("h743.flash"),
        note("h743.dtcm"),
        note("h743.axi"),
        note("h743.sram3"),
    ],
};

const FOLDER: &str = "examples/stm32h743";
const PROGRAM: &str = "stm32h743";

/// A memory of the part: RM0433, table 7.
struct Memory {
    /// Its name in the figures.
    id: &'static str,
    name: &'static str,
    range: Range<u64>,
    holds: &'static str,
}

const ITCM: Memory = Memory {
    id: "itcm",
    name: "instruction TCM",
    range: 0..0x1_0000,
    holds: "the control tick and the query, copied from flash at start",
};
const FLASH: Memory = Memory {
    id: "flash",
    name: "flash",
    range: 0x0800_0000..0x0820_0000,
    holds: "the tree, the idle loop, the drivers, constants, and what is copied",
};
const DTCM: Memory = Memory {
    id: "dtcm",
    name: "data TCM",
    range: 0x2000_0000..0x2002_0000,
    holds: "the stack in its lower half, then the state of the control tick",
};
const AXI: Memory = Memory {
    id: "axi",
    name: "AXI SRAM",
    range: 0x2400_0000..0x2408_0000,
    holds: "both vertex buffers and all other variables, cached",
};
const SRAM3: Memory = Memory {
    id: "sram3",
    name: "SRAM3",
    range: 0x3004_0000..0x3004_8000,
    holds: "descriptors and buffers of the Ethernet DMA, not cached",
};

const MEMORIES: [&Memory; 5] = [&ITCM, &FLASH, &DTCM, &AXI, &SRAM3];

/// A bus, by the feature that selects it, and the variables that must be in certain memories.
struct Variant {
    features: &'static [&'static str],
    /// The figure that counts its drivers' panic paths.
    panics: &'static str,
    /// The handlers of its interrupts.
    interrupts: &'static [&'static str],
    places: &'static [(&'static str, &'static Memory)],
}

const VARIANTS: [Variant; 2] = [
    Variant {
        features: &[],
        panics: "panics.ethernet",
        interrupts: &["ETH"],
        places: &[
            ("stm32h743::SURFACE", &AXI),
            ("stm32h743::tick::CONTROL", &DTCM),
            ("controller::surface::BYTES", &FLASH),
            ("stm32h743::bus::QUEUE", &SRAM3),
        ],
    },
    Variant {
        features: &["--features", "fdcan"],
        panics: "panics.fdcan",
        interrupts: &["FDCAN1_IT0", "FDCAN1_IT1"],
        places: &[
            ("stm32h743::SURFACE", &AXI),
            ("stm32h743::tick::CONTROL", &DTCM),
            ("controller::surface::BYTES", &FLASH),
        ],
    },
];

/// The program's files that call drivers. The compiler merges panic paths of a driver there, so that they have no line.
const WRAPPERS: [&str; 3] = ["src/clocks.rs", "src/ethernet.rs", "src/fdcan.rs"];

/// The name under which merged panic paths are counted.
const MERGED: &str = "merged";

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let cross = Cross::find()?;
    let mut found = Found::default();
    for variant in &VARIANTS {
        found.add(variant, &build(&cross, variant)?).context(variant.panics)?;
    }
    // Also builds the program that measures cycles on the board.
    let mut cycles = cross.cargo_apart(FOLDER, "build");
    run(cycles.args(["--quiet", "--release", "--bin", "cycles"]))?;
    for (id, figure) in &found.figures {
        figures.note(&format!("h743.{id}"), *figure as f64);
    }
    let places = found.drivers.iter().map(|(place, count)| format!("{place} {count}"));
    figures.text("h743.panics.places", places.collect::<Vec<_>>().join(", "));
    for fault in &found.faults {
        println!("{fault}");
    }
    Ok(Outcome::Passed)
}

fn build(cross: &Cross, variant: &Variant) -> Result<PathBuf> {
    let mut cargo = cross.cargo_apart(FOLDER, "build");
    cargo.args(["--quiet", "--release", "--bin", PROGRAM]).args(variant.features);
    run(&mut cargo)?;
    Ok(cross.program_apart(FOLDER, PROGRAM))
}

/// Figures of all variants: the maximum of sizes, and the sum of faults.
#[derive(Default)]
struct Found {
    figures: BTreeMap<&'static str, u64>,
    /// Panic paths of the drivers, by crate.
    drivers: BTreeMap<String, u64>,
    /// Violated promises, as text.
    faults: Vec<String>,
}

impl Found {
    fn add(&mut self, variant: &Variant, program: &Path) -> Result<()> {
        let binary = Binary::read(program)?;
        let bytes = fs::read(program)?;
        let file = object::File::parse(&*bytes)?;
        // The linker's script puts the rare functions there.
        let rare = place(&file, "__rare_start")?.start..place(&file, "__rare_end")?.start;
        self.add_tick(variant, &binary, &rare)?;
        self.add_panics(variant, program, &binary)?;
        self.add_places(variant, &file)?;
        self.add_sizes(&file)?;
        let footprint = Footprint::read(program)?;
        self.largest("flash", footprint.flash);
        self.sum("allocators", footprint.allocators.len() as u64);
        Ok(())
    }

    fn sum(&mut self, id: &'static str, more: u64) {
        *self.figures.entry(id).or_default() += more;
    }

    fn largest(&mut self, id: &'static str, size: u64) {
        let figure = self.figures.entry(id).or_default();
        *figure = (*figure).max(size);
    }

    /// Adds every function below the vector of the control tick, and the addresses of those that are not rare.
    fn add_tick(&mut self, variant: &Variant, binary: &Binary, rare: &Range<u64>) -> Result<()> {
        let tick = binary.handler(15)?;
        ensure!(binary.name(tick) == Some("SysTick"), "the tick's vector leads elsewhere");
        let (below, panicking) = (binary.below(tick), binary.panicking());
        ensure!(!panicking.is_empty(), "no panic function, though the drivers have panic paths");
        let is_query = |at: &u32| binary.name(*at).is_some_and(|n| n.contains("dibs_nostd::query"));
        ensure!(below.iter().any(is_query), "the tick asks no query");
        // Stack of the idle loop, a bus's interrupt, and the tick.
        let interrupts =
            variant.interrupts.iter().map(|name| binary.depth(binary.exception(name)?));
        let interrupt = interrupts.collect::<Result<Vec<_>>>()?.into_iter().max().unwrap_or(0);
        let stack = binary.depth(1)? + interrupt + binary.depth(15)? + 2 * EXCEPTION_FRAME;
        self.largest("stack", u64::from(stack));
        self.largest("stack.room", u64::from(binary.stack_room));
        let often = binary.below_but(tick, |at| rare.contains(&u64::from(at)));
        let outside: Vec<u32> =
            often.iter().copied().filter(|&at| !ITCM.range.contains(&u64::from(at))).collect();
        let mut panics = binary.indirect(tick);
        let names = |at: &u32| binary.name(*at).unwrap_or("no function").to_owned();
        panics.extend(below.intersection(&panicking).map(names));
        self.faults.extend(outside.iter().map(|at| format!("not in the ITCM: {}", names(at))));
        self.faults.extend(panics.iter().map(|name| format!("panics: {name}")));
        self.sum("tick.functions", often.len() as u64);
        self.sum("tick.outside", outside.len() as u64);
        self.sum("tick.panics", panics.len() as u64);
        Ok(())
    }

    /// Adds every branch to a function that panics, grouped by the code that contains it.
    fn add_panics(&mut self, variant: &Variant, program: &Path, binary: &Binary) -> Result<()> {
        let loader =
            Loader::new(program).map_err(|error| anyhow!("no debug information: {error}"))?;
        let (mut own, mut drivers) = (0, 0);
        for branch in binary.branches_to(&binary.panicking()) {
            let source = Source::of(&loader, branch)?;
            match source.driver() {
                Some(name) => {
                    drivers += 1;
                    *self.drivers.entry(name.to_owned()).or_default() += 1;
                }
                None => {
                    own += 1;
                    self.faults.push(format!("a panic path at {branch:#x}, {source:?}"));
                }
            }
        }
        self.sum("panics", own);
        self.sum(variant.panics, drivers);
        Ok(())
    }

    fn add_places(&mut self, variant: &Variant, file: &object::File<'_>) -> Result<()> {
        let mut faults = Vec::new();
        for &(name, memory) in variant.places {
            let place = place(file, name)?;
            if place.start < memory.range.start || place.end > memory.range.end {
                faults.push(format!("{name} is at {:#x}", place.start));
            }
            if memory.id == SRAM3.id && is_cached(file, &place)? {
                faults.push(format!("{name} is cached"));
            }
        }
        self.sum("misplaced", faults.len() as u64);
        self.faults.extend(faults);
        Ok(())
    }

    /// Adds the used bytes of each memory except flash, which also contains what is copied from it.
    fn add_sizes(&mut self, file: &object::File<'_>) -> Result<()> {
        for memory in MEMORIES.iter().filter(|memory| memory.id != FLASH.id) {
            let sections = file.sections().filter(|s| memory.range.contains(&s.address()));
            let is_there = |section: &object::Section<'_, '_>| match section.flags() {
                SectionFlags::Elf { sh_flags, .. } => {
                    sh_flags & elf::SHF_ALLOC != elf::SectionFlags(0)
                }
                _ => false,
            };
            let size = sections.filter(is_there).map(|section| section.size()).sum();
            self.largest(memory.id, size);
        }
        Ok(())
    }
}

/// The addresses of a variable.
fn place(file: &object::File<'_>, name: &str) -> Result<Range<u64>> {
    let mut symbols = file.symbols().filter(|symbol| {
        let mangled = symbol.name().unwrap_or_default();
        format!("{:#}", rustc_demangle::demangle(mangled)) == name
    });
    let symbol = symbols.next().with_context(|| format!("no variable {name}"))?;
    Ok(symbol.address()..symbol.address() + symbol.size())
}

/// Whether the program's regions of the protection unit let these addresses be cached: fields TEX, C and B of the last
/// region that contains them differ from those of normal memory without cache (ARMv7-M manual, B3.5.9).
fn is_cached(file: &object::File<'_>, addresses: &Range<u64>) -> Result<bool> {
    let table = place(file, "stm32h743::memory::REGIONS")?;
    let bytes = file.sections().find_map(|section| {
        section.data_range(table.start, table.end - table.start).ok().flatten()
    });
    let words = bytes.context("the table of regions has no content")?.chunks_exact(4);
    let words: Vec<u32> = words.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let prevails = words.as_chunks().0.iter().rev().find(|&&[base, log2, _]| {
        let (start, size) = (u64::from(base), 1_u64 << log2);
        (start..start + size).contains(&addresses.start) && addresses.end <= start + size
    });
    Ok(prevails.is_none_or(|[_, _, attributes]| attributes >> 16 & 0b11_1011 != 0b00_1000))
}

/// The innermost code at an address that is not in the standard library.
#[derive(Debug)]
struct Source {
    file: String,
    /// 0 if the compiler has merged branches of several lines.
    line: u32,
}

impl Source {
    fn of(loader: &Loader, address: u32) -> Result<Self> {
        let mut frames =
            loader.find_frames(u64::from(address)).map_err(|error| anyhow!("{error}"))?;
        let mut found = Self { file: "unknown code".to_owned(), line: 1 };
        while let Some(frame) = frames.next().map_err(|error| anyhow!("{error}"))? {
            let Some(location) = frame.location else { continue };
            let Some(file) = location.file else { continue };
            found = Self { file: file.to_owned(), line: location.line.unwrap_or(0) };
            if !["/rustc/", "library/core/"].iter().any(|part| file.contains(part)) {
                break;
            }
        }
        Ok(found)
    }

    /// The driver's crate; `None` for the controller's own code, and for unknown code.
    fn driver(&self) -> Option<&str> {
        if self.line == 0 && WRAPPERS.iter().any(|wrapper| self.file.ends_with(wrapper)) {
            return Some(MERGED);
        }
        // The folders of the registry and of a build script's output contain the crate's name and version, or a number.
        let (_, rest) = match self.file.split_once("/registry/src/") {
            Some((_, rest)) => rest.split_once('/')?,
            None => self.file.split_once("/release/build/")?,
        };
        Some(rest.split('/').next()?.rsplit_once('-')?.0)
    }
}

/// The memory map of docs/boards.md and the drivers' panic paths, from the records.
pub fn table() -> Result<String> {
    let figure = |id: &str| record::figure(&format!("h743.{id}"));
    let mut text = String::from(
        "| memory | addresses | holds | bytes in use | of |\n|---|---|---|---:|---:|\n",
    );
    for memory in MEMORIES {
        let used = figure(memory.id)?;
        // The stack's half of the memory is not a section.
        let used = if memory.id == DTCM.id { used + figure("stack.room")? } else { used };
        let Range { start, end } = memory.range;
        let (name, holds) = (memory.name, memory.holds);
        text += &format!(
            "| {name} | `{start:#010x}` to `{:#010x}` | {holds} | {used} | {} |\n",
            end - 1,
            end - start
        );
    }
    text += &format!(
        "\nThe stack takes at most {} of its {} bytes, by the instructions. Branches to a panic: {} in the controller's own \
         code, {} in the drivers of the program for Ethernet, {} in those of the program for FDCAN. By crate, in both: {}.\n",
        figure("stack")?,
        figure("stack.room")?,
        figure("panics")?,
        figure("panics.ethernet")?,
        figure("panics.fdcan")?,
        record::text("h743.panics.places")?,
    );
    Ok(text)
}

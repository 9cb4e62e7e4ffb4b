//! `cargo xtask guarantees`: every promise measured, and docs/guarantees.* written from it.
//!
//! Each check puts its figures under their names into [`Figures`]; `promises` says what every figure
//! promises and what bounds it; `record` joins the two into docs/guarantees.json, and `markdown` makes
//! docs/guarantees.md of that. `cargo xtask test` runs the same checks, and fails where a figure breaks its
//! bound or falls behind the committed one by more than its tolerance.

mod bits;
mod bus;
mod callgrind;
mod cost;
mod demo;
mod faults;
mod figures;
mod markdown;
mod modes;
mod path;
mod probe;
pub mod profile;
mod promises;
mod receive;
mod record;
mod script;
mod stack;
mod torn;

use std::fs;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::nightly::{self, FuzzOptions, Fuzzed};
use crate::process::run as run_command;
use crate::steps::{Outcome, Steps};
use crate::toolchain::Cross;
use crate::{qemu, workspace};
use cost::Machine;
use figures::Figures;

/// Measures every promise, and writes docs/guarantees.json and docs/guarantees.md.
#[derive(clap::Args)]
pub struct Options {
    /// Fits the constants of the cost model anew (`--only board`, `--only host`: of one machine), and ends; the
    /// checks are another run, of a program that has them.
    #[arg(long)]
    fit: bool,
    /// Seconds of each fuzz target.
    #[arg(long, default_value_t = 60)]
    fuzz_seconds: u32,
    /// Makes docs/guarantees.md anew from docs/guarantees.json, and measures nothing.
    #[arg(long)]
    render: bool,
    /// As few cases as `cargo xtask test` takes, for a quick look.
    #[arg(long)]
    quick: bool,
    /// Only checks whose names contain this; the other records stay as they are.
    #[arg(long)]
    only: Option<String>,
}

/// How much is tried.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Cases on this computer.
    pub cases: usize,
    /// Queries that must give the same bits.
    pub bits: usize,
    /// Queries that must keep to their bound.
    pub costs: usize,
    /// The same on this computer, under callgrind.
    pub host_costs: usize,
    /// Ticks of table 3's path on the board.
    pub ticks: u32,
    /// Poses that hurt, on the board.
    pub poses: usize,
    /// Queries under which frames are published.
    pub torn: u32,
    /// Faults of each kind on the board's bus.
    pub board_faults: u32,
    /// Seconds of the controller's time.
    pub demo_seconds: u32,
    /// The same, with faults on the bus.
    pub fault_seconds: u32,
    /// Seconds of each fuzz target.
    pub fuzz_seconds: u32,
}

impl Effort {
    /// What the documents state.
    const FULL: Self = Self {
        cases: 1_000_000,
        bits: 100_000,
        costs: 100_000,
        host_costs: 100_000,
        ticks: 2_000,
        poses: 10_000,
        torn: 100_000,
        board_faults: 100,
        demo_seconds: 20,
        fault_seconds: 60,
        fuzz_seconds: 60,
    };
    /// What every run of the tests can afford.
    pub const TEST: Self = Self {
        cases: 100_000,
        bits: 10_000,
        costs: 10_000,
        host_costs: 5_000,
        ticks: 250,
        poses: 1_000,
        torn: 8_000,
        board_faults: 1,
        demo_seconds: 5,
        fault_seconds: 20,
        fuzz_seconds: 60,
    };
}

/// Measures, and writes the documents.
pub fn run(options: &Options) -> Result<()> {
    if options.fit {
        let wanted = |name: &str| options.only.as_deref().is_none_or(|only| name.contains(only));
        if wanted("host") {
            cost::fit(&Machine::Host, 4_000)?;
        }
        if wanted("board") {
            cost::fit(&Machine::M7(&board()?), 12_000)?;
        }
        return Ok(());
    }
    if options.render {
        return record::render();
    }
    let effort = if options.quick { Effort::TEST } else { Effort::FULL };
    let effort = Effort { fuzz_seconds: options.fuzz_seconds, ..effort };
    let mut steps = Steps::default();
    let figures = check(effort, options.only.as_deref(), &mut steps);
    steps.run("documents", || {
        record::write(&figures)?;
        Ok(Outcome::Passed)
    });
    steps.finish();
    Ok(())
}

/// Runs the checks as steps of `cargo xtask test`, and compares their figures with the committed ones.
pub fn test(effort: Effort, steps: &mut Steps) {
    let figures = check(effort, None, steps);
    steps.run("figures within their bounds", || record::compare(&figures));
}

/// Runs every check as a step.
fn check(effort: Effort, only: Option<&str>, steps: &mut Steps) -> Figures {
    let mut figures = Figures::default();
    let mut step = |name: &str, check: &dyn Fn(&mut Figures) -> Result<Outcome>| {
        if only.is_none_or(|only| name.contains(only)) {
            steps.run(name, || check(&mut figures));
        }
    };
    let passed = |result: Result<()>| result.map(|()| Outcome::Passed);
    step("budgets and corruption on this computer", &|f| passed(on_this_computer(effort, f)));
    step("every interleaving of the frames", &|f| {
        f.note("frames.interleavings", nightly::interleavings()? as f64);
        Ok(Outcome::Passed)
    });
    step("instructions on this computer", &|f| passed(callgrind::check(f)));
    step("the same bits everywhere", &|f| passed(bits::check(&board()?, effort.bits, f)));
    step("cost model on the board", &|f| {
        passed(cost::check(&Machine::M7(&board()?), effort.costs, f))
    });
    step("cost model on this computer", &|f| {
        passed(cost::check(&Machine::Host, effort.host_costs, f))
    });
    step("queries on the board", &|f| passed(path::check(&board()?, &effort, f)));
    step("modal surfaces on the board", &|f| passed(modes::check(&board()?, f)));
    step("receiving on the board", &|f| passed(receive::check(&board()?, f)));
    step("torn reads on the board", &|f| passed(torn::check(&board()?, effort.torn, f)));
    step("faults on the board", &|f| passed(bus::check(&board()?, effort.board_faults, f)));
    step("demo on the emulated board", &|f| passed(demo::check(effort.demo_seconds, f)));
    step("demo with faults on the bus", &|f| passed(demo::faults(effort.fault_seconds, f)));
    step("demo with a tree that rots", &|f| passed(demo::rot(f)));
    step("firmware without panic and allocator", &|f| passed(demo::link(&board()?, f)));
    step("stack of the firmware", &|f| passed(demo::stack(&board()?, f)));
    for sanitizer in ["address", "thread"] {
        step(&format!("{sanitizer} sanitizer"), &|f| {
            if let Some(reason) = nightly::missing() {
                f.skip("sanitizer.");
                return Ok(Outcome::Skipped(reason));
            }
            let sanitized = nightly::sanitize(sanitizer)?;
            f.note(&format!("sanitizer.{sanitizer}"), sanitized.findings as f64);
            f.note(&format!("sanitizer.{sanitizer}.tests"), sanitized.tests as f64);
            ensure!(sanitized.findings == 0, "{} findings", sanitized.findings);
            Ok(Outcome::Passed)
        });
    }
    step("miri", &|_| match nightly::miri_missing() {
        Some(reason) => Ok(Outcome::Skipped(reason)),
        None => passed(nightly::miri()),
    });
    step("fuzzers", &|f| {
        if let Some(reason) = nightly::missing() {
            f.skip("fuzz.");
            return Ok(Outcome::Skipped(reason));
        }
        let options = FuzzOptions { seconds: effort.fuzz_seconds, target: None };
        let fuzzed = nightly::fuzz(&options)?;
        for Fuzzed { target, inputs, .. } in &fuzzed {
            f.note(&format!("fuzz.{target}.inputs"), *inputs as f64);
        }
        let findings: Vec<String> = fuzzed.into_iter().filter_map(|f| f.finding).collect();
        f.note("fuzz.seconds", f64::from(effort.fuzz_seconds));
        f.note("fuzz.findings", findings.len() as f64);
        ensure!(findings.is_empty(), "{}", findings.join("\n"));
        Ok(Outcome::Passed)
    });
    figures
}

fn board() -> Result<Cross> {
    let cross = Cross::find()?;
    qemu::find()?;
    Ok(cross)
}

/// The checks of `tests/benches/guarantees`.
fn on_this_computer(effort: Effort, figures: &mut Figures) -> Result<()> {
    let folder = workspace::root().join("target").join("guarantees");
    fs::create_dir_all(&folder)?;
    let file = folder.join("host.json");
    let mut cargo = Command::new("cargo");
    cargo.args(["bench", "--quiet", "--package", "dibs-tests", "--bench", "guarantees", "--"]);
    cargo.args(["--cases", &effort.cases.to_string(), "--out"]).arg(&file);
    run_command(cargo.current_dir(workspace::root()))?;
    figures.read(&file)
}

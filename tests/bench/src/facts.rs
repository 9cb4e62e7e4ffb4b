//! The run's machine, compiler and command.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Deserialize;

use super::measure::clock;
use super::names::DIBS;
use super::plan::{Only, Options, Plan};
use super::record::{Cell, Record, Records};
use dibs_prove::data::real;
use dibs_prove::harness::run::Run;

pub fn run(plan: &Plan, options: &Options, records: &mut Records) {
    of("run", plan, options, records);
}

/// The facts of an experiment that may be recorded by itself.
pub fn of(experiment: &str, plan: &Plan, options: &Options, records: &mut Records) {
    let Run { date, commit, compiler, machine, .. } = Run::now(plan.name.to_owned());
    let mut command = "cargo xtask bench".to_owned();
    if options.quick {
        command += " --quick";
    }
    if options.release {
        command += " --release";
    }
    if let Some(queries) = options.queries {
        command += &format!(" --queries {queries}");
    }
    match options.only {
        Some(Only::Paper) => command += " --only paper",
        Some(Only::Embedded) => command += " --only embedded",
        Some(Only::Imaging) => command += " --only imaging",
        Some(Only::Contacts) => command += " --only contacts",
        Some(Only::Tracker) => command += " --only tracker",
        None => (),
    }
    let meshes = match real() {
        Some(_) => "real anatomy (human brains and a human heart, beside the repository)",
        None => "generated: the real ones are not on this machine",
    };
    for (metric, note) in [
        ("kind", plan.name.to_owned()),
        ("machine", machine),
        ("commit", commit),
        ("date", date),
        ("command", command),
        ("compiler", compiler),
        ("meshes", meshes.to_owned()),
    ] {
        records.push(Record::fact(experiment, metric, note));
    }
    let cell = Cell { experiment: experiment.to_owned(), ..Cell::default() };
    records.push(Record::number(&cell, "", "clock", clock(), "us"));
}

/// The part of the demo's report that is used here.
#[derive(Deserialize)]
struct Demo {
    ticks: u64,
    instructions_mean: Option<f64>,
    instructions_max: Option<f64>,
    node_tests_mean: f64,
    triangle_tests_mean: f64,
    surface: String,
    stretch_limit: f64,
}

/// The board's clock, in Hz.
const CLOCK_RATE: f64 = 480e6;

/// Adds the demo's figures on the emulated Cortex-M7.
pub fn cortex_m7(path: &Path, records: &mut Records) -> Result<()> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    let demo: Demo =
        serde_json::from_str(&text).with_context(|| format!("{name} is not the demo's report"))?;
    let (Some(mean), Some(max)) = (demo.instructions_mean, demo.instructions_max) else {
        return Ok(());
    };
    let cell = Cell::new("cortex-m7", &demo.surface, 0, "capsule");
    let mut instructions = Record::number(&cell, DIBS, "instructions", mean, "instructions");
    (instructions.summary.max, instructions.summary.n) = (max, demo.ticks);
    records.push(instructions);
    for (metric, value, unit) in [
        ("frequency_mean", CLOCK_RATE / mean, "Hz at one cycle an instruction"),
        ("frequency_worst", CLOCK_RATE / max, "Hz at one cycle an instruction"),
        ("node_tests", demo.node_tests_mean, "tests"),
        ("triangle_tests", demo.triangle_tests_mean, "tests"),
        ("stretch_limit", demo.stretch_limit, ""),
    ] {
        records.push(Record::number(&cell, DIBS, metric, value, unit));
    }
    Ok(())
}

//! What the run ran on, and how.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use serde::Deserialize;

use super::measure::clock;
use super::names::DIBS;
use super::plan::{Arguments, Plan};
use super::record::{Cell, Record, Records};
use super::subjects;

pub fn run(plan: &Plan, arguments: &Arguments, records: &mut Records) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut command = "cargo xtask bench".to_owned();
    if arguments.quick {
        command += " --quick";
    }
    if let Some(queries) = arguments.queries {
        command += &format!(" --queries {queries}");
    }
    let meshes = match subjects::real() {
        Some(_) => "real anatomy (human brains and a human heart, beside the repository)",
        None => "generated: the real ones are not on this machine",
    };
    for (metric, note) in [
        ("kind", plan.name.to_owned()),
        ("machine", format!("{}, {cores} cores, {}", processor(), std::env::consts::OS)),
        ("commit", commit()),
        ("command", command),
        ("compiler", said("rustc", &["--version"])),
        ("meshes", meshes.to_owned()),
    ] {
        records.push(Record::fact(metric, note));
    }
    let cell = Cell { experiment: "run".to_owned(), ..Cell::default() };
    records.push(Record::number(&cell, "", "clock", clock(), "us"));
}

/// The commit that is run.
pub fn commit() -> String {
    said("git", &["describe", "--always", "--dirty", "--abbrev=12"])
}

fn processor() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = known.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.to_owned())
}

fn said(program: &str, arguments: &[&str]) -> String {
    let folder = env!("CARGO_MANIFEST_DIR");
    let output = Command::new(program).args(arguments).current_dir(folder).output();
    let text = output.ok().filter(|o| o.status.success()).map(|o| o.stdout).unwrap_or_default();
    match String::from_utf8_lossy(&text).trim() {
        "" => "unknown".to_owned(),
        text => text.to_owned(),
    }
}

/// What `cargo xtask demo` reports, as far as it is needed here.
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

/// Adds what the demo showed on the emulated Cortex-M7.
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
    (instructions.max, instructions.n) = (max, demo.ticks);
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

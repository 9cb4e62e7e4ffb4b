//! The firmware's own promises: deadlines in the demo, and its stack.

use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::figures::Figures;
use super::stack::Binary;
use crate::firmware::{self, Footprint, Surface};
use crate::toolchain::Cross;
use crate::{demo, qemu, workspace};

/// Runs the demo on the emulated board, and takes over its report.
pub fn check(seconds: u32, figures: &mut Figures) -> Result<()> {
    let report = report_of(seconds, false)?;
    for (name, field) in [
        ("demo.ticks", "ticks"),
        ("demo.misses", "deadline_misses"),
        ("demo.latency", "latency_max_us"),
        ("demo.tick", "tick_max_us"),
        ("demo.mismatches", "mismatches"),
        ("demo.compared", "frames_compared"),
        ("demo.wrong", "frames_published_wrong"),
        ("interrupts.masked", "masked_max_us"),
        ("interrupts.bus-masked", "bus_masked_max_us"),
        ("stack.measured", "stack_bytes"),
    ] {
        figures.note(name, number(&report[field], field)?);
    }
    Ok(())
}

/// The same with faults on the bus, which also falls silent for a while.
pub fn faults(seconds: u32, figures: &mut Figures) -> Result<()> {
    let report = report_of(seconds, true)?;
    for (name, field) in [
        ("demo.faults.ticks", "ticks"),
        ("demo.faults.misses", "deadline_misses"),
        ("demo.faults.mismatches", "mismatches"),
        ("demo.faults.compared", "frames_compared"),
        ("demo.faults.wrong", "frames_published_wrong"),
        ("demo.faults.rejected", "frames_rejected"),
    ] {
        figures.note(name, number(&report[field], field)?);
    }
    let injected = report["faults"]["injected"].as_object().context("no faults in the report")?;
    let injected: u64 = injected.values().filter_map(Value::as_u64).sum();
    figures.note("demo.faults.injected", injected as f64);
    for (name, field) in [
        ("demo.faults.safe-after-packet", "since_packet"),
        ("demo.faults.safe-after-frame", "since_frame"),
        ("demo.faults.recovered-after", "recovered_after"),
    ] {
        figures.note(name, number(&report["silence"][field], field)?);
    }
    Ok(())
}

/// A bit of the tree in flash flips: nothing is acted on.
pub fn rot(figures: &mut Figures) -> Result<()> {
    let rotted = demo::rot::run(3)?;
    figures.note("demo.rot.ticks", rotted.ticks as f64);
    figures.note("demo.rot", rotted.acted as f64);
    Ok(())
}

fn report_of(seconds: u32, faults: bool) -> Result<Value> {
    let name = if faults { "demo-faults" } else { "demo" };
    let output = workspace::root().join("target").join("guarantees").join(name);
    demo::run(&demo::Options {
        seconds,
        faults,
        seed: 1,
        board_only: true,
        output: Some(output.clone()),
        ..demo::Options::default()
    })?;
    let text = fs::read_to_string(output.join("report.json"))?;
    Ok(serde_json::from_str(&text)?)
}

fn number(value: &Value, field: &str) -> Result<f64> {
    value.as_f64().with_context(|| format!("no {field} in the report"))
}

/// The firmware links, which it does only without panic paths; it has no allocator; and a panic
/// path put in on purpose breaks the link, so that the first check is known to check.
pub fn link(cross: &Cross, figures: &mut Figures) -> Result<()> {
    let surface = Surface::default();
    let footprint = Footprint::read(&firmware::build(cross, &surface)?)?;
    figures.note("allocators", footprint.allocators.len() as f64);
    figures.note("panics", footprint.panics.len() as f64);
    let found = [&footprint.allocators[..], &footprint.panics].concat().join(", ");
    ensure!(found.is_empty(), "the firmware has {found}");

    let mut planted = firmware::command(cross, &surface);
    let build = planted.args(["--features", "planted-panic"]).output()?;
    let said = String::from_utf8_lossy(&build.stderr);
    ensure!(!build.status.success(), "a planted panic path did not break the link");
    ensure!(said.contains("a_panic_path_survived"), "it broke something else:\n{said}");

    let mut in_rounds = firmware::command(cross, &surface);
    crate::process::run(in_rounds.args(["--features", "in-rounds"]))
        .context("queries in rounds have a panic path")
}

/// Bounds the firmware's stack, and lets it overflow on purpose.
pub fn stack(cross: &Cross, figures: &mut Figures) -> Result<()> {
    let program = firmware::build(cross, &Surface::default())?;
    let binary = Binary::read(&program)?;
    let worst = binary.worst()?;
    figures.note("stack.idle", f64::from(worst.idle));
    figures.note("stack.bus", f64::from(worst.bus));
    figures.note("stack.control", f64::from(worst.control));
    figures.note("stack.bound", f64::from(worst.total));
    figures.note("stack.room", f64::from(binary.stack_room));
    let indirect = binary.indirect_when_idle();
    figures.note("stack.indirect", indirect.len() as f64);
    ensure!(indirect.is_empty(), "start-up calls through a register: {}", indirect.join(", "));
    figures.note("interrupts.masking", binary.masking.len() as f64);
    if !binary.masking.is_empty() {
        println!("functions that mask interrupts: {}", binary.masking.join(", "));
    }
    let noticed = overflow_is_noticed(cross)?;
    figures.note("stack.overflow-unnoticed", f64::from(!noticed));
    ensure!(noticed, "an overflowing stack did not end in the fault handler");
    Ok(())
}

/// A stack that overflows stops the firmware at once, through its fault handler.
fn overflow_is_noticed(cross: &Cross) -> Result<bool> {
    let mut cargo = firmware::command(cross, &Surface::default());
    crate::process::run(cargo.args(["--features", "planted-overflow"]))?;
    let program = cross.program("firmware", "board");
    let mut qemu = qemu::alone(&program, qemu::Time::Real, &["board", "100"]);
    qemu.stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = qemu.spawn()?;
    let start = Instant::now();
    let code = loop {
        match child.try_wait()? {
            Some(status) => break status.code(),
            None if start.elapsed() > Duration::from_secs(20) => {
                child.kill()?;
                child.wait()?;
                break None;
            }
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    // The program of before, for whoever comes next.
    firmware::build(cross, &Surface::default())?;
    Ok(code == Some(1))
}

//! The demo on the emulated board: deadlines, answers, and read-back of every published frame.

// Requirements: A-01, B-01, P-03

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use xtask::steps::Outcome;
use xtask::workspace;

use crate::demo;
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, MEMORY, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo on the emulated board",
    run: check,
    promises: &[
        Promise {
            id: "stack.measured",
            says: "Stack used in the demo, by the paint that is gone",
            criterion: MEMORY,
            bound: Bound::NotAbove("stack.bound"),
            unit: "bytes",
            limits: "One run's depth.",
        },
        note("demo.ticks"),
        note("demo.answers"),
        Promise {
            id: "demo.misses",
            says: "No control tick at 1 kHz is missed or late while the bus is busy throughout",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.ticks} ticks on the emulated board",
            limits: "500 million instructions a second, one a cycle.",
        },
        Promise {
            id: "demo.mismatches",
            says: "Every answer of the demo agrees with exhaustive search in f64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.answers} answers in {demo.ticks} ticks",
            limits: "Ticks without an answer, before the first frame, have nothing to compare.",
        },
        Promise {
            id: "demo.latency",
            says: "Emulated: the longest time from the moment that a control tick is due to its first instruction",
            criterion: TIMING,
            bound: Bound::AtMost(2.0),
            unit: "µs",
            limits: "A section with interrupts disabled would show here. The emulator enters an exception in no time: a processor \
                     adds its entry, some tens of cycles, and the cache misses of the handler.",
        },
        Promise {
            id: "demo.tick",
            says: "Emulated: longest control tick, from the moment that it is due to its end",
            criterion: TIMING,
            bound: Bound::AtMost(240.0),
            unit: "µs",
            limits: "At 500 million instructions a second: 120,000 instructions.",
        },
        note("demo.compared"),
        Promise {
            id: "demo.wrong",
            says: "Every frame that the board published is, to the bit, one that was sent",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.compared} frames, read back by a checksum of all positions in the board's memory",
            limits: "CRC-32.",
        },
        note("demo.age"),
        note("demo.oldest"),
        Promise {
            id: "demo.rate",
            says: "Frames of all vertices, quantised, that arrive over Ethernet, are checked and published",
            criterion: TIMING,
            bound: Bound::AtLeast(50.0),
            unit: "a second of the controller's own time; the surface is {demo.age} ms old on average, {demo.oldest} at most",
            limits: "The emulated LAN9118 is as fast as the loop that polls it; the sender sends 62 a second.",
        },
        note("demo.packet-share"),
        Promise {
            id: "demo.network-share",
            says: "Share of the instructions that the network takes: driver, ARP, IPv4 and UDP",
            criterion: TIMING,
            bound: Bound::AtMost(10.0),
            unit: "% of all; another {demo.packet-share} % check and decode the packets",
            limits: "By the clock, less the control ticks in between. Register accesses take longer on silicon than their \
                     instruction.",
        },
        Promise {
            id: "interrupts.masked",
            says: "Longest section with all interrupts disabled, by the clock around it: start-up takes the peripherals",
            criterion: TIMING,
            bound: Bound::AtMost(1.0),
            unit: "µs at most, before the first tick; after that there is none",
            limits: "The clock counts in 0.04 µs, 20 instructions. The one function of the row below.",
        },
        Promise {
            id: "interrupts.bus-masked",
            says: "Longest section with the bus interrupt disabled: a slice of the checks in the background",
            criterion: TIMING,
            bound: Bound::AtMost(20.0),
            unit: "µs",
            limits: "Control ticks in its midst, which keep the bus waiting anyway, taken off. A UART with a buffer, \
         or DMA, bridges both.",
        },
    ],
};

/// Records the figures of the demo's report.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let report = report_of(Run { seconds: effort.demo_seconds, ..Run::default() })?;
    for (name, field) in [
        ("demo.ticks", "ticks"),
        ("demo.answers", "queries"),
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
    figures.note("demo.rate", number(&report["frames_per_second"], "frames_per_second")?);
    figures.note("demo.age", number(&report["surface_age_mean_ms"], "surface_age_mean_ms")?);
    figures.note("demo.oldest", number(&report["surface_age_max_ms"], "surface_age_max_ms")?);
    for (name, field) in
        [("demo.network-share", "driver_share"), ("demo.packet-share", "packet_share")]
    {
        figures.note(name, number(&report["network"][field], field)? * 100.0);
    }
    keep(effort, "demo", "heart")?;
    Ok(Outcome::Passed)
}

/// Options of a run of the demo.
#[derive(Clone, Copy, Default)]
pub struct Run {
    pub seconds: u32,
    /// Faults on the bus.
    pub faults: bool,
    /// Whether the controller is the one in C.
    pub c: bool,
    /// Whether a simulated hand pushes the instrument, instead of the script.
    pub hand: bool,
    /// Whether the nodes of a lattice move the heart.
    pub nodes: bool,
}

/// The report of a demo.
pub fn report_of(Run { seconds, faults, c, hand, nodes }: Run) -> Result<Value> {
    let name = match (faults, c) {
        (false, false) if hand && nodes => "demo-nodes-hand",
        (false, false) if hand => "demo-hand",
        (false, false) if nodes => "demo-nodes",
        (false, false) => "demo",
        (true, false) => "demo-faults",
        (false, true) => "demo-c",
        (true, true) => "demo-c-faults",
    };
    let output = folder(name);
    demo::run(&demo::Options {
        seconds,
        faults,
        c,
        script: !hand,
        nodes: nodes.then(|| demo::scene::cells(demo::LATTICE)).transpose()?,
        seed: 1,
        board_only: true,
        output: Some(output.clone()),
        ..demo::Options::default()
    })?;
    written(&output)
}

pub fn folder(name: &str) -> PathBuf {
    workspace::target().join("guarantees").join(name)
}

/// Keeps the report and the pictures of a recorded run in the folder `demo/NAME` of the evidence.
pub fn keep(effort: &Effort, from: &str, name: &str) -> Result<()> {
    if !effort.is_record {
        return Ok(());
    }
    let to = workspace::evidence().join("demo").join(name);
    fs::create_dir_all(&to)?;
    for file in fs::read_dir(folder(from))? {
        let file = file?;
        let name = file.file_name();
        if name == "report.json" || Path::new(&name).extension().is_some_and(|kind| kind == "svg") {
            fs::copy(file.path(), to.join(name))?;
        }
    }
    Ok(())
}

/// The report in a folder.
pub fn written(folder: &Path) -> Result<Value> {
    let text = fs::read_to_string(folder.join("report.json"))?;
    Ok(serde_json::from_str(&text)?)
}

/// A number of the report.
pub fn number(value: &Value, field: &str) -> Result<f64> {
    value.as_f64().with_context(|| format!("no {field} in the report"))
}

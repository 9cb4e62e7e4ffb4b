//! The demo on a heart of 50,000 triangles that a lattice's nodes move.

// Requirements: F-07, P-03

use anyhow::Result;
use xtask::steps::Outcome;

use super::demo::{Run, number, report_of};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, RESOURCES, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo with nodes on the emulated board",
    run: check,
    promises: &[
        note("demo.nodes.ticks"),
        note("demo.nodes.answers"),
        Promise {
            id: "demo.nodes.mismatches",
            says: "With a heart of 50,000 triangles that 720 nodes carry, every answer of the demo agrees with exhaustive search in \
                   f64 on the vertices that the frames' nodes make",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.nodes.answers} answers in {demo.nodes.ticks} ticks",
            limits: "Vertices are evaluated in f64 on this side.",
        },
        Promise {
            id: "demo.nodes.wrong",
            says: "Every frame of nodes that the board published is, to the bit, one that was sent",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {demo.nodes.compared} frames, {demo.nodes.rate} a second over Ethernet",
            limits: "CRC-32.",
        },
        note("demo.nodes.compared"),
        note("demo.nodes.rate"),
        Promise {
            id: "demo.nodes.listed",
            says: "An answer of the guard then, side and contacts included, in the mean of ticks with the axis outside",
            criterion: TIMING,
            bound: Bound::AtMost(120_000.0),
            unit: "instructions; {demo.nodes.all} with the depth of a crossing axis in the mean of all, {demo.nodes.largest} at most",
            limits: "The generated heart beats in real time, extrapolated between frames at 60 Hz; a capsule by the script. \
                     Before the firmware listed contacts it was 47,862, and the bound 60,000 (commit 991fa126).",
        },
        note("demo.nodes.all"),
        note("demo.nodes.largest"),
        Promise {
            id: "demo.nodes.misses",
            says: "No control tick is missed or late then",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {demo.nodes.ticks} ticks at 1 kHz",
            limits: "500 million instructions a second, one a cycle.",
        },
        Promise {
            id: "demo.nodes.ram",
            says: "RAM of that controller, its stack included",
            criterion: RESOURCES,
            bound: Bound::AtMost(384.0 * 1_024.0),
            unit: "bytes",
            limits: "Variables, and the stack by the paint that is gone.",
        },
        Promise {
            id: "demo.nodes.flash",
            says: "Flash of its tree, nodes and adjacency included",
            criterion: RESOURCES,
            bound: Bound::AtMost(24.0),
            unit: "bytes a triangle",
            limits: "The whole firmware takes {demo.nodes.firmware} bytes.",
        },
        note("demo.nodes.firmware"),
    ],
};

/// Records the figures of the demo's report.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let report = report_of(Run { seconds: effort.demo_seconds, nodes: true, ..Run::default() })?;
    for (name, field) in [
        ("demo.nodes.ticks", "ticks"),
        ("demo.nodes.answers", "queries"),
        ("demo.nodes.mismatches", "mismatches"),
        ("demo.nodes.compared", "frames_compared"),
        ("demo.nodes.wrong", "frames_published_wrong"),
        ("demo.nodes.misses", "deadline_misses"),
        ("demo.nodes.largest", "instructions_max"),
        ("demo.nodes.ram", "ram_bytes"),
        ("demo.nodes.firmware", "flash_bytes"),
    ] {
        figures.note(name, number(&report[field], field)?);
    }
    let hundredths = |field: &str| {
        Ok::<_, anyhow::Error>((number(&report[field], field)? * 100.0).round() / 100.0)
    };
    figures.note("demo.nodes.rate", hundredths("frames_per_second")?);
    figures.note("demo.nodes.listed", hundredths("instructions_outside_mean")?.round());
    figures.note("demo.nodes.all", hundredths("instructions_mean")?.round());
    figures.note("demo.nodes.flash", hundredths("tree_bytes_per_triangle")?);
    Ok(Outcome::Passed)
}

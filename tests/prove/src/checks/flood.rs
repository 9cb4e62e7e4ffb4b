//! The emulated board on a flooded network.

// Requirement: P-03

use anyhow::{Context, Result, ensure};
use xtask::steps::Outcome;

use crate::demo::flood::{CALM, CALM_EVERY};
use crate::demo::machine::Machine;
use crate::demo::scene::Scene;
use crate::demo::session::{self, Harm};
use crate::demo::{Options, freshness};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FAULTS, FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "network flooded on the board",
    run: check,
    promises: &[
        note("flood.ticks"),
        note("flood.sent"),
        note("flood.taken"),
        note("flood.good"),
        note("flood.answers"),
        note("flood.compared"),
        note("flood.calm"),
        Promise {
            id: "flood.misses",
            says: "No control tick at 1 kHz is missed or late on a flooded network",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {flood.ticks} ticks; {flood.sent} frames of garbage, repeats, fragments, ARP and broadcasts were sent, and \
         {flood.taken} frames taken, {flood.good} of them with good packets; the flood rests for {flood.calm} % of the \
         time, so that frames come through",
            limits: "The emulator's Ethernet controller has the LAN9118's buffers; a bus master with DMA would take \
                     memory cycles from the processor, which this one does not.",
        },
        Promise {
            id: "flood.latency",
            says: "Emulated: the longest time from the moment that a control tick is due to its first instruction, flooded",
            criterion: TIMING,
            bound: Bound::AtMost(2.0),
            unit: "µs",
            limits: "As for the demo.",
        },
        Promise {
            id: "flood.wrong",
            says: "Nothing is published then that was not sent",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {flood.compared} frames read back",
            limits: "CRC-32.",
        },
        Promise {
            id: "flood.mismatches",
            says: "Every answer then agrees with exhaustive search in f64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {flood.answers} answers",
            limits: "",
        },
        Promise {
            id: "flood.rate",
            says: "Frames published a second on a flooded network",
            criterion: FAULTS,
            bound: Bound::Informs,
            unit: "frames a second of the controller's time",
            limits: "Packets that meet a full buffer are lost, and their frame with them: most frames come through while the \
                     flood rests.",
        },
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let options = Options { board_only: true, script: true, ..Options::default() };
    let scene = Scene::load(&options)?;
    let machine = Machine::prepare(&options, &scene)?;
    let folder = tempfile::tempdir()?;
    let outcome =
        session::run(&scene, &machine, effort.flood_seconds, &Harm::Flood(1), folder.path())?;
    let network = outcome.network.context("the board tells nothing of its network")?;
    let flood = outcome.flood;
    let summary = outcome.summary;
    let count = |is_wrong: usize| is_wrong as f64;
    figures.note("flood.ticks", f64::from(summary.ticks));
    figures.note("flood.sent", flood as f64);
    figures.note("flood.taken", f64::from(network.frames));
    figures.note("flood.good", f64::from(network.good));
    figures.note("flood.answers", count(outcome.checked.len()));
    figures.note("flood.compared", count(outcome.compared.len()));
    figures.note("flood.calm", f64::from(CALM) / f64::from(CALM_EVERY) * 100.0);
    figures.note("flood.misses", f64::from(summary.deadline_misses));
    figures.note("flood.latency", f64::from(summary.latency_counts) / 25.0);
    figures.note("flood.wrong", count(outcome.compared.iter().filter(|c| !c.is_same).count()));
    let mismatches = outcome.checked.iter().filter(|c| c.is_wrong()).count();
    figures.note("flood.mismatches", count(mismatches));
    figures.note("flood.rate", freshness::rate(&outcome.ticks));
    ensure!(outcome.exited_well, "the controller ended with an error");
    ensure!(!outcome.compared.is_empty(), "no frame came through the flood");
    let others = network.frames - network.good;
    ensure!(others > summary.ticks, "{others} frames of the flood were taken: that is none");
    Ok(Outcome::Passed)
}

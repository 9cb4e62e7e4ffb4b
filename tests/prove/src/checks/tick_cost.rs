//! The cost of a tracker's ticks: a line fitted above the instructions of ticks within a budget, with a margin, and checked
//! on other surfaces and speeds.

// Requirements: A-05, T-02

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};
use dibs_nostd::{Budget, Cost};
use probe::track::tick;
use rayon::prelude::*;
use xtask::process::run;
use xtask::steps::Outcome;
use xtask::workspace;

use super::bounded::rows::{DEARER, HUMAN, Row, SHAFT, USUAL};
use super::bounded::scene::{Scene, on_board};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "cost model of a tracker's ticks",
    run: check,
    promises: &[
        note("tick.ticks"),
        note("tick.surfaces"),
        Promise {
            id: "tick.late",
            says: "A tracker's ticks with `Budget::for_instructions` by `Cost::of_tick` that end later",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {tick.ticks} ticks on the emulated Cortex-M7, within 20,000, 40,000, 60,000, 100,000 and 400,000 \
                   instructions: {tick.surfaces}",
            limits: "Not a proof: for vertices and for nodes a line above the measured ticks of the first surface's path, with a margin of \
                     15 %; the others are not in the fit. A capsule; closest pair, side and depth, and the same with the contacts within 5 mm; instructions, \
                     not cycles.",
        },
        Promise {
            id: "tick.largest-share",
            says: "Tightness: what the largest of these ticks takes of its budget",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "%",
            limits: "Constants: {tick.base} + {tick.test} a test, and {tick.nodes.base} + {tick.nodes.test} where nodes carry the \
                     surface.",
        },
        note("tick.base"),
        note("tick.test"),
        note("tick.nodes.base"),
        note("tick.nodes.test"),
    ],
};

/// Margin on the fitted constants, in per cent: on a surface outside of the fit the dearest tick was 10 per cent above.
const MARGIN: u32 = 15;

/// The instructions for which budgets are made.
const DEADLINES: [u32; 5] = [20_000, 40_000, 60_000, 100_000, 400_000];

/// What a tick finds besides the closest pair: nothing, or all contacts.
const KINDS: [u32; 2] = [0, tick::CONTACTS];

/// A tick's tests, less the root's, which the base includes; and its instructions.
type Sample = (u32, u32);

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let [usual, ..] = USUAL;
    let [fast, large] = DEARER;
    let [.., through] = SHAFT;
    let mut names = vec![
        "a generated heart of 10,272 triangles",
        "the same at twice the speed",
        "one of 40,000",
        "a shaft through the first",
    ];
    let mut scenes = [usual, fast, large, through]
        .map(|row| row.scene())
        .into_iter()
        .collect::<Result<Vec<_>>>()?;
    scenes.push(HUMAN.scene()?);
    names.push("a human heart of 10,272");
    if scenes.iter().any(Option::is_none) {
        println!("skipped: the real heart is not beside the repository");
        (scenes, names) =
            (scenes.into_iter().filter(Option::is_some).collect(), names[..4].to_vec());
    }
    scenes.extend([Some(carried()?), Some(Scene::carried(10_272, [5, 4, 4], CARRIED_TICKS)?)]);
    names.extend(["one of 50,000 that 720 nodes carry", "one of 10,272 and 150 nodes"]);
    let deadlines = KINDS.iter().flat_map(|&bits| DEADLINES.map(|most| (bits, most)));
    let deadlines: Vec<_> = deadlines.collect();
    let cases: Vec<_> = deadlines
        .iter()
        .flat_map(|&(bits, most)| {
            let scenes = scenes.iter().flatten().zip(&names);
            scenes.map(move |(scene, name)| (scene, name, bits, most))
        })
        .collect();
    let shares = cases.par_iter().map(|&(scene, name, bits, most)| {
        let ticks = on_board(scene, bits, Budget::for_instructions(most, &scene.cost()))?;
        let shares = ticks.iter().map(|tick| f64::from(tick.instructions) / f64::from(most));
        let shares: Vec<f64> = shares.collect();
        let (kind, largest) = (if bits == 0 { "pair" } else { "contacts" }, largest(&shares));
        println!("{kind} within {most} instructions, {name}: at most {:.1} %", 100.0 * largest);
        Ok(shares)
    });
    let shares = shares.collect::<Result<Vec<_>>>()?.concat();
    figures.note("tick.ticks", shares.len() as f64);
    figures.text("tick.surfaces", names.join(", "));
    figures.note("tick.late", shares.iter().filter(|&&share| share > 1.0).count() as f64);
    figures.note("tick.largest-share", (1_000.0 * largest(&shares)).round() / 10.0);
    for (name, cost) in [("tick", Cost::M7_TICK), ("tick.nodes", Cost::M7_NODES_TICK)] {
        figures.note(&format!("{name}.base"), f64::from(cost.base));
        figures.note(&format!("{name}.test"), f64::from(cost.node_test));
    }
    Ok(Outcome::Passed)
}

fn largest(shares: &[f64]) -> f64 {
    shares.iter().copied().fold(0.0, f64::max)
}

/// Ticks on a surface that nodes carry: each takes longer to emulate.
const CARRIED_TICKS: usize = 10_000;

/// The surface that nodes carry in the fit.
fn carried() -> Result<Scene> {
    Scene::carried(50_000, [9, 8, 7], CARRIED_TICKS)
}

/// Fits the lines whose names contain `only`, and writes them into the core crate.
pub fn fit(only: Option<&str>) -> Result<()> {
    let is_wanted = |name: &str| only.is_none_or(|only| name.contains(only));
    if is_wanted("tick") {
        let [usual, ..] = USUAL;
        let scene = usual.scene()?.context("a generated scene")?;
        let says = "within a budget, with contacts or without, on a Cortex-M7";
        fit_to(&scene, ("cost_tick.rs", "M7_TICK", says))?;
    }
    if is_wanted("nodes") {
        let says = "within a budget on a surface that nodes carry, on a Cortex-M7";
        fit_to(&carried()?, ("cost_nodes.rs", "M7_NODES_TICK", says))?;
    }
    Ok(())
}

/// Fits the line to a scene's ticks.
fn fit_to(scene: &Scene, (file, name, says): (&str, &str, &str)) -> Result<()> {
    let budgets = USUAL.iter().map(Row::budget).collect::<Result<Vec<_>>>()?;
    let cases: Vec<_> =
        KINDS.iter().flat_map(|&bits| budgets.iter().map(move |&budget| (bits, budget))).collect();
    let samples = cases.par_iter().map(|&(bits, budget)| {
        let ticks = on_board(scene, bits, budget)?;
        Ok(ticks
            .iter()
            .map(|tick| (tick.work().saturating_sub(1), tick.instructions))
            .collect::<Vec<Sample>>())
    });
    let samples = samples.collect::<Result<Vec<_>>>()?.concat();
    let usual = budgets.iter().map(|budget| budget.tests()).sum::<u32>() / budgets.len() as u32;
    let (base, test) = line_above(&samples, usual);
    let [base, test] = [base, test].map(|constant| (constant * (100 + MARGIN)).div_ceil(100));
    let triangle = test * Budget::TRIANGLE;
    let file = workspace::root().join("dibs-nostd/src/query").join(file);
    fs::write(
        &file,
        format!(
            "//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {{
    /// A [`Tracker`](crate::Tracker)'s tick {says}.
    pub const {name}: Self = Self {{ base: {base}, node_test: {test}, triangle_test: {triangle} }};
}}
"
        ),
    )
    .with_context(|| format!("cannot write {}", file.display()))?;
    run(Command::new("rustfmt").args(["--edition", "2024"]).arg(&file))?;
    println!("{name}: {base} + {test} a test");
    Ok(())
}

/// The line above all samples that is lowest at `usual` tests.
fn line_above(samples: &[Sample], usual: u32) -> (u32, u32) {
    const DEAREST: u32 = 1_000;
    let base = |test: u32| {
        let bases =
            samples.iter().map(|&(tests, instructions)| instructions.saturating_sub(test * tests));
        bases.max().unwrap_or_default()
    };
    let lines = (1..DEAREST).map(|test| (base(test), test));
    lines.min_by_key(|&(base, test)| base + test * usual).unwrap_or_default()
}

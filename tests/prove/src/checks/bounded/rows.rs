//! The rows of the table of bounded ticks: a scene and the most instructions of a tick each. A tracker's budget is in
//! tests, and is measured on the board: a large one whose ticks all stay within a row's instructions. Halving finds it, to a
//! 128th of the range that it starts with, and supposes that the dearest tick takes more if the budget grows.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use dibs_nostd::{Budget, Cost};
use probe::track::tick;
use rayon::prelude::*;
use xtask::workspace;

use super::budgets::TESTS;
use super::scene::{Scene, on_board};
use crate::harness::figures::Figures;
use crate::probe::ticks::Tick;

/// A row of the table.
pub struct Row {
    /// How the names of its figures start.
    pub name: &'static str,
    /// The most instructions of a tick.
    most: u32,
    /// The scene with a path of this many ticks; none if its mesh is not on this machine.
    scene: fn(usize) -> Result<Option<Scene>>,
    /// What else than the closest pair a tick finds.
    bits: u32,
}

pub const USUAL: [Row; 4] = [
    usual("bounded.20k", 20_000, 0),
    usual("bounded.40k", 40_000, 0),
    usual("bounded.60k", 60_000, 0),
    usual("bounded.100k", 100_000, 0),
];

pub const LISTED: [Row; 3] = [
    usual("listed.40k", 40_000, tick::CONTACTS),
    usual("listed.60k", 60_000, tick::CONTACTS),
    usual("listed.100k", 100_000, tick::CONTACTS),
];

pub const DEARER: [Row; 2] = [
    Row {
        name: "dearer.fast",
        most: 60_000,
        scene: |ticks| Scene::heart(10_272, 2.0, ticks).map(Some),
        bits: 0,
    },
    Row {
        name: "dearer.large",
        most: 60_000,
        scene: |ticks| Scene::heart(40_000, 1.0, ticks).map(Some),
        bits: 0,
    },
];

pub const SHAFT: [Row; 4] = [
    shaft("shaft.20k", 20_000),
    shaft("shaft.40k", 40_000),
    shaft("shaft.60k", 60_000),
    shaft("shaft.100k", 100_000),
];

pub const HUMAN: Row = Row { name: "dearer.human", most: 60_000, scene: Scene::human, bits: 0 };

const fn usual(name: &'static str, most: u32, bits: u32) -> Row {
    Row { name, most, scene: |ticks| Scene::heart(10_272, 1.0, ticks).map(Some), bits }
}

const fn shaft(name: &'static str, most: u32) -> Row {
    Row { name, most, scene: Scene::through_heart, bits: 0 }
}

/// The fewest instructions that a test is taken to need.
const CHEAPEST: u32 = 100;

/// Ticks of a path.
pub const TICKS: usize = 30_000;

/// Halvings of the range in which a budget is searched.
const HALVINGS: u32 = 7;

/// The dearest work of a tick that is not begun if the budget does not cover it: a turn of the axis' division, with a bound
/// on the depth between two points.
pub const DEAREST: u32 = 40;

impl Row {
    /// The scene; none if its mesh is not on this machine.
    pub fn scene(&self) -> Result<Option<Scene>> {
        (self.scene)(TICKS)
    }

    /// The row's budget, measured to fit.
    pub fn budget(&self) -> Result<Budget> {
        let budget = TESTS.iter().find(|(name, _)| *name == self.name);
        let (_, tests) = budget.with_context(|| format!("{}: no budget", self.name))?;
        Ok(Budget::new(*tests))
    }

    /// The budget that a user gets for its instructions.
    pub const fn of_user(&self) -> Budget {
        Budget::for_instructions(self.most, &Cost::M7_TICK)
    }

    /// Notes its budget, and on the board the instructions of its largest and its mean tick, and in the median of those
    /// that use the whole budget. `work` is that of the ticks on this computer, which must be the same there.
    pub fn note_board(&self, scene: &Scene, work: &[u32], figures: &mut Figures) -> Result<()> {
        let budget = self.budget()?;
        let mut ticks = on_board(scene, self.bits, budget)?;
        let here = work.iter().skip(1);
        let other = here.zip(&ticks).position(|(&here, there)| here != there.work());
        ensure!(other.is_none(), "{}: other tests on the board, after tick {other:?}", self.name);
        ticks.sort_unstable_by_key(|tick| tick.instructions);
        let taken: Vec<f64> = ticks.iter().map(|tick| tick.instructions.into()).collect();
        let is_spent = |tick: &&Tick| tick.work() + DEAREST > budget.tests();
        let spent: Vec<u32> = ticks.iter().filter(is_spent).map(|tick| tick.instructions).collect();
        let mean = taken.iter().sum::<f64>() / taken.len() as f64;
        let mut note =
            |end: &str, figure: f64| figures.note(&format!("{}.{end}", self.name), figure);
        note("tests", budget.tests().into());
        note("mean", mean.round());
        note("spent", spent.get(spent.len() / 2).copied().unwrap_or_default().into());
        note("instructions", taken.last().copied().unwrap_or_default());
        Ok(())
    }

    /// Tests with which every tick stays within the instructions, by halving; none if the mesh is not on this machine.
    fn fitting(&self) -> Result<Option<u32>> {
        let Some(scene) = self.scene()? else { return Ok(None) };
        let (mut fits, mut over) = (0_u32, self.most / CHEAPEST);
        for _ in 0..HALVINGS {
            let tests = fits.midpoint(over);
            let ticks = on_board(&scene, self.bits, Budget::new(tests))?;
            let is_fitting = ticks.iter().all(|tick| tick.instructions <= self.most);
            *if is_fitting { &mut fits } else { &mut over } = tests;
        }
        ensure!(fits > 0, "{}: no tick stays within {} instructions", self.name, self.most);
        Ok(Some(fits))
    }
}

/// Measures again the budgets of the rows whose names contain `only`, and writes all to their file.
pub fn fit(only: Option<&str>) -> Result<()> {
    let rows: Vec<Row> =
        USUAL.into_iter().chain(LISTED).chain(DEARER).chain(SHAFT).chain([HUMAN]).collect();
    let wanted = |row: &Row| only.is_none_or(|only| row.name.contains(only));
    if !rows.iter().any(wanted) {
        return Ok(());
    }
    let file: PathBuf = workspace::root().join("tests/prove/src/checks/bounded/budgets.rs");
    // This program may be older than the file.
    let before = fs::read_to_string(&file)?;
    let lines = rows.par_iter().map(|row| {
        let start = format!("    (\"{}\", ", row.name);
        let line = before.lines().find(|line| line.starts_with(&start));
        let measured = if wanted(row) { row.fitting()? } else { None };
        Ok(match measured {
            Some(tests) => {
                println!("{}: {tests} tests in {} instructions", row.name, row.most);
                format!("{start}{tests}),\n")
            }
            None => format!("{}\n", line.with_context(|| format!("{}: no budget", row.name))?),
        })
    });
    let lines: String = lines.collect::<Result<_>>()?;
    let mut text = String::new();
    writeln!(
        text,
        "//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit."
    )?;
    writeln!(
        text,
        "\n/// The budget in tests of each row.\npub const TESTS: &[(&str, u32)] = &[\n{lines}];"
    )?;
    fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))
}

//! The cost model: constants fitted above the instructions of adversarial queries, with a margin, and checked on
//! surfaces and poses that were not used in the fit. A fitted bound, not a proof.

// Requirement: A-05

use std::fs;
use std::process::Command;
use std::thread;

use anyhow::{Context, Result, bail};
use dibs_build::generate;
use dibs_nostd::Cost;
use dibs_tests::surfaces;
use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};
use xtask::process::run;
use xtask::steps::Outcome;
use xtask::toolchain::Cross;
use xtask::workspace;

use crate::data::real;
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden, note};
use crate::harness::{Check, Effort};
use crate::probe::script::{Draw, Record, Script, Subject};
use crate::probe::{Answers, Build, board, build_for_board, on_board};

pub const BOARD: Check = Check {
    name: "cost model on the board",
    run: on_board_check,
    promises: &[
        note("cost.queries"),
        note("cost.surfaces"),
        Promise {
            id: "cost.beyond",
            says: "Queries above `Cost`, a fitted bound with a margin of 20 %, on surfaces and poses that the fit has not seen",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {cost.queries} adversarial queries on the emulated Cortex-M7, about {cost.surfaces}",
            limits: "Not a proof: a plane above measured queries of four small surfaces, with a margin. Vertex tables that \
                     are slices of `Vec3`; instructions, not cycles.",
        },
        Promise {
            id: "cost.late",
            says: "Queries with `Budget::for_instructions` that end later",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of half of {cost.queries} queries",
            limits: "Deadlines above `Cost::base`.",
        },
        Promise {
            id: "cost.sphere.mean-share",
            says: "Tightness, sphere: what a query takes of its bound",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "% on average, {cost.sphere.largest-share} % at the most",
            limits: "Constants: {cost.sphere.base} + {cost.sphere.node-test} n + {cost.sphere.triangle-test} t.",
        },
        Promise {
            id: "cost.capsule.mean-share",
            says: "Tightness, capsule",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "% on average, {cost.capsule.largest-share} % at the most",
            limits: "Constants: {cost.capsule.base} + {cost.capsule.node-test} n + {cost.capsule.triangle-test} t.",
        },
        note("cost.sphere.largest-share"),
        note("cost.sphere.base"),
        note("cost.sphere.node-test"),
        note("cost.sphere.triangle-test"),
        note("cost.capsule.largest-share"),
        note("cost.capsule.base"),
        note("cost.capsule.node-test"),
        note("cost.capsule.triangle-test"),
        golden("m7.sphere.mean"),
        golden("m7.sphere.largest"),
        golden("m7.capsule.mean"),
        golden("m7.capsule.largest"),
        golden("m7.stretch"),
    ],
};

pub const HOST: Check = Check {
    name: "cost model on this computer",
    run: on_host_check,
    promises: &[
        note("cost.host.queries"),
        note("cost.host.surfaces"),
        Promise {
            id: "cost.host.beyond",
            says: "The same on x86-64: queries above `Cost`",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {cost.host.queries} adversarial queries under callgrind, about {cost.host.surfaces}",
            limits: "As above; instructions of the compiler in use.",
        },
        Promise {
            id: "cost.host.late",
            says: "Queries with `Budget::for_instructions` that end later, on x86-64",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of half of {cost.host.queries} queries",
            limits: "As above.",
        },
        Promise {
            id: "cost.host.sphere.mean-share",
            says: "Tightness on x86-64, sphere",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "% on average, {cost.host.sphere.largest-share} % at the most",
            limits: "Constants: {cost.host.sphere.base} + {cost.host.sphere.node-test} n + \
         {cost.host.sphere.triangle-test} t.",
        },
        Promise {
            id: "cost.host.capsule.mean-share",
            says: "Tightness on x86-64, capsule",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "% on average, {cost.host.capsule.largest-share} % at the most",
            limits: "Constants: {cost.host.capsule.base} + {cost.host.capsule.node-test} n + \
         {cost.host.capsule.triangle-test} t.",
        },
        note("cost.host.sphere.largest-share"),
        note("cost.host.sphere.base"),
        note("cost.host.sphere.node-test"),
        note("cost.host.sphere.triangle-test"),
        note("cost.host.capsule.largest-share"),
        note("cost.host.capsule.base"),
        note("cost.host.capsule.node-test"),
        note("cost.host.capsule.triangle-test"),
    ],
};

/// Margin on the fitted constants, in per cent: the fitted queries are a sample. Of 100,000 other queries on the same
/// surfaces one was 13 per cent above the fitted plane.
const MARGIN: f64 = 20.0;

/// A query's cost.
#[derive(Clone, Copy)]
struct Sample {
    tests: [u32; 2],
    instructions: u32,
}

/// The machine whose instructions are counted.
pub enum Machine<'a> {
    /// The emulated Cortex-M7.
    M7(&'a Cross),
    /// This computer, by callgrind.
    Host,
}

impl Machine<'_> {
    fn answers(&self, script: &Script) -> Result<Answers> {
        match self {
            Self::M7(cross) => on_board(&build_for_board(cross, "probe")?, script, true),
            Self::Host => Build::Release.counted(script),
        }
    }

    /// The answers to several scripts, executed in parallel.
    fn all(&self, scripts: &[Script]) -> Result<Vec<Answers>> {
        thread::scope(|scope| {
            let running: Vec<_> =
                scripts.iter().map(|script| scope.spawn(|| self.answers(script))).collect();
            let joined = running.into_iter().map(|thread| match thread.join() {
                Ok(answers) => answers,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            joined.collect()
        })
    }

    /// The committed constants, for a sphere and a capsule.
    fn costs(&self) -> [Cost; 2] {
        match self {
            Self::M7(_) => [Cost::M7_SPHERE, Cost::M7_CAPSULE],
            Self::Host => [Cost::X86_64_SPHERE, Cost::X86_64_CAPSULE],
        }
    }

    /// The prefix of the figures' names.
    fn prefix(&self) -> &'static str {
        match self {
            Self::M7(_) => "cost",
            Self::Host => "cost.host",
        }
    }
}

fn on_board_check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    check(&Machine::M7(&board()?), effort.costs, figures)
}

fn on_host_check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    check(&Machine::Host, effort.host_costs, figures)
}

/// Fits the constants for both machines, or for the named one.
pub fn fit(only: Option<&str>) -> Result<()> {
    let wanted = |name: &str| only.is_none_or(|only| name.contains(only));
    if wanted("host") {
        fit_on(&Machine::Host, 4_000)?;
    }
    if wanted("board") {
        fit_on(&Machine::M7(&board()?), 12_000)?;
    }
    Ok(())
}

/// Fits the constants, and writes them into the core crate.
fn fit_on(machine: &Machine<'_>, queries: usize) -> Result<()> {
    let mut spheres = Vec::new();
    let mut capsules = Vec::new();
    // Most queries have a budget, which may end a search whose tests cost more than average.
    let deadline = Draw::Deadline(machine.costs());
    let draws = [(Draw::Exhausting, 1), (Draw::Any, 1), (Draw::Short, 8), (deadline, 8)];
    let scripts: Vec<Script> = draws
        .into_iter()
        .enumerate()
        .map(|(i, (draw, times))| Script::adversarial(times * queries, draw, 11 + i as u64))
        .collect();
    for answers in machine.all(&scripts)? {
        spheres.extend(samples(&answers, false));
        capsules.extend(samples(&answers, true));
    }
    let constants = [plane_above(&spheres)?, plane_above(&capsules)?];
    let [sphere, capsule] = constants.map(|c| {
        let Cost { base, node_test, triangle_test } = c;
        format!("Self {{ base: {base}, node_test: {node_test}, triangle_test: {triangle_test} }}")
    });
    let (file, name, on, how) = match machine {
        Machine::M7(_) => ("cost_m7.rs", "M7", "on a Cortex-M7", "on an emulated Cortex-M7"),
        Machine::Host => ("cost_x86_64.rs", "X86_64", "on x86-64, optimised", "by callgrind"),
    };
    let file = workspace::root().join("dibs-nostd/src/query").join(file);
    fs::write(
        &file,
        format!(
            "//! Measured {how}. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {{
    /// A sphere {on}.
    pub const {name}_SPHERE: Self = {sphere};
    /// A capsule {on}.
    pub const {name}_CAPSULE: Self = {capsule};
}}
"
        ),
    )
    .with_context(|| format!("cannot write {}", file.display()))?;
    run(Command::new("rustfmt").args(["--edition", "2024"]).arg(&file))?;
    println!("sphere: {sphere}\ncapsule: {capsule}");
    Ok(())
}

/// Checks the constants on queries that were not used in the fit.
fn check(machine: &Machine<'_>, queries: usize, figures: &mut Figures) -> Result<Outcome> {
    let (prefix, costs) = (machine.prefix(), machine.costs());
    let (mut beyond, mut late, mut checked) = (0, 0, 0_usize);
    let mut tightness: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    let subjects = unseen()?;
    let names: Vec<_> = subjects.iter().map(|subject| subject.name).collect();
    figures.text(&format!("{prefix}.surfaces"), names.join(", "));
    // Half of the queries are complete searches, half have a budget made for a deadline.
    let scripts = [(Draw::Exhausting, 21), (Draw::Deadline(costs), 22)]
        .map(|(draw, seed)| Script::about_all(&subjects, true, queries / 2, draw, seed));
    for answers in machine.all(&scripts)? {
        for answer in answers.iter() {
            let Record::Query { is_capsule, deadline, .. } = answer.record else { continue };
            let [node_tests, triangle_tests] = answer.tests();
            let bound = costs[usize::from(is_capsule)].instructions(node_tests, triangle_tests);
            let took = answer.instructions;
            checked += 1;
            beyond += u32::from(u64::from(took) > bound);
            late += u32::from(deadline.is_some_and(|deadline| took > deadline));
            tightness[usize::from(is_capsule)].push(f64::from(took) / bound as f64);
        }
    }
    figures.note(&format!("{prefix}.queries"), checked as f64);
    figures.note(&format!("{prefix}.beyond"), f64::from(beyond));
    figures.note(&format!("{prefix}.late"), f64::from(late));
    for ((name, shares), cost) in ["sphere", "capsule"].iter().zip(&tightness).zip(costs) {
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let most = shares.iter().copied().fold(0.0, f64::max);
        for (figure, value) in [
            ("mean-share", 100.0 * mean),
            ("largest-share", 100.0 * most),
            ("base", f64::from(cost.base)),
            ("node-test", f64::from(cost.node_test)),
            ("triangle-test", f64::from(cost.triangle_test)),
        ] {
            figures.note(&format!("{prefix}.{name}.{figure}"), value);
        }
    }
    if matches!(machine, Machine::M7(_)) {
        usual(&machine.answers(&Script::usual(800, 31))?, figures);
    }
    Ok(Outcome::Passed)
}

/// Surfaces that were not used in the fit: with other sizes, shapes and leaves, and real anatomy if present.
pub fn unseen() -> Result<Vec<Subject>> {
    let mut subjects = vec![
        Subject::new("a generated heart of 2,562 triangles", generate::heart(2_562)?.mesh, 8),
        Subject::new("a generated brain of 3,000", generate::brain(3_000)?, 6),
        Subject::new("a ball of 128", surfaces::ball(2), 3),
        Subject::new("1,200 slivers", surfaces::slivers(150), 4),
    ];
    match real() {
        Some(folder) => {
            let brain = dibs_build::read(folder.join("brain_5k.ply"))?.mesh;
            subjects.push(Subject::new("a human brain of 5,000", brain, 8));
            let heart = dibs_build::read(folder.join("heart_10272.ply"))?.mesh;
            subjects.push(Subject::new("a human heart of 10,272", heart, 8));
        }
        None => println!("skipped: the real brain and heart are not beside the repository"),
    }
    Ok(subjects)
}

/// The typical case, for comparison between commits.
fn usual(answers: &Answers, figures: &mut Figures) {
    for (name, is_capsule) in [("sphere", false), ("capsule", true)] {
        let samples = samples(answers, is_capsule);
        let sum: f64 = samples.iter().map(|sample| f64::from(sample.instructions)).sum();
        let most = samples.iter().map(|sample| sample.instructions).max().unwrap_or_default();
        figures.note(&format!("m7.{name}.mean"), (sum / samples.len() as f64).round());
        figures.note(&format!("m7.{name}.largest"), f64::from(most));
    }
    let a_triangle = answers.iter().filter_map(|answer| match answer.record {
        Record::Stretch(triangles) => Some(f64::from(answer.instructions) / f64::from(triangles)),
        _ => None,
    });
    figures.note("m7.stretch", a_triangle.fold(0.0, f64::max).round());
}

fn samples(answers: &Answers, capsules: bool) -> Vec<Sample> {
    let wanted =
        |record| matches!(record, Record::Query { is_capsule, .. } if is_capsule == capsules);
    answers
        .iter()
        .filter(|answer| wanted(answer.record))
        .map(|answer| Sample { tests: answer.tests(), instructions: answer.instructions })
        .collect()
}

/// The plane above all samples that is lowest on average: a linear program, to which only the binding constraints are
/// added.
fn plane_above(samples: &[Sample]) -> Result<Cost> {
    let count = samples.len() as f64;
    let mean =
        |of: fn(&Sample) -> u32| samples.iter().map(|s| f64::from(of(s))).sum::<f64>() / count;
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let free = (0.0, f64::INFINITY);
    let constants = [
        problem.add_var(1.0, free),
        problem.add_var(mean(|s| s.tests[0]), free),
        problem.add_var(mean(|s| s.tests[1]), free),
    ];
    let mut chosen: Vec<Sample> = samples.iter().take(3).copied().collect();
    loop {
        let mut with_chosen = problem.clone();
        for sample in &chosen {
            let factors = [1.0, f64::from(sample.tests[0]), f64::from(sample.tests[1])];
            let terms: Vec<_> = constants.into_iter().zip(factors).collect();
            with_chosen.add_constraint(terms, ComparisonOp::Ge, f64::from(sample.instructions));
        }
        let solved = with_chosen.solve().context("no plane above the samples")?;
        let SolveOutcome::Solution(solution) = solved else { bail!("no plane in time") };
        let [base, node, triangle] = constants.map(|constant| solution[constant]);
        let above = |s: &Sample| {
            let [nodes, triangles] = s.tests.map(f64::from);
            f64::from(s.instructions) - (base + node * nodes + triangle * triangles)
        };
        let Some(worst) = samples.iter().max_by(|a, b| above(a).total_cmp(&above(b))) else {
            bail!("no samples");
        };
        if above(worst) <= 0.5 {
            let raised = |constant: f64| (constant * (1.0 + MARGIN / 100.0)).ceil() as u32;
            return Ok(Cost {
                base: raised(base),
                node_test: raised(node),
                triangle_test: raised(triangle),
            });
        }
        chosen.push(*worst);
    }
}

//! One harness for all promises. A check, one file in `checks/`, measures figures and states a promise for each; the
//! records combine both in docs/evidence/guarantees.json, from which docs/evidence/guarantees.md is made. `cargo xtask
//! test` runs the same checks on fewer cases, and compares their figures with the records.

mod effort;
mod faults;
pub mod figures;
pub mod lanes;
pub mod markdown;
pub mod promise;
pub mod record;
pub mod run;

use std::path::PathBuf;

use anyhow::{Result, ensure};
use xtask::steps::{Outcome, Steps};

use crate::checks::{BESIDE, BINDINGS, CHECKS, ON_REQUEST};
use crate::evidence::pages;
pub use effort::Effort;
use figures::Figures;
use lanes::Beside;
use promise::Promise;
use record::Raise;
use run::Run;

/// A check, and the promises of its figures.
pub struct Check {
    /// The step's name, which `--only` selects by.
    pub name: &'static str,
    /// One promise for every figure that the check measures.
    pub promises: &'static [Promise],
    /// Measures.
    pub run: fn(&Effort, &mut Figures) -> Result<Outcome>,
}

/// Measures every promise, and writes docs/evidence/guarantees.json and docs/evidence/guarantees.md.
#[derive(clap::Args)]
pub struct Options {
    /// Fits the constants of the cost model again (`--only board`, `--only host`: for one machine; `--only tick`: of
    /// a tracker's ticks) and the budgets of the table of bounded ticks (`--only bounded.60k`: of one row), and ends; then
    /// run the checks with a program that has the new constants.
    #[arg(long)]
    fit: bool,
    /// Seconds of each fuzz target.
    #[arg(long, default_value_t = 60)]
    fuzz_seconds: u32,
    /// Makes docs/evidence/guarantees.md from docs/evidence/guarantees.json, without measuring.
    #[arg(long)]
    render: bool,
    /// As few cases as `cargo xtask test` uses, for a quick look: nothing is written.
    #[arg(long)]
    quick: bool,
    /// This fraction (1/N) of the full number of cases, but no fewer than `cargo xtask test` uses.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100))]
    share: u32,
    /// Only checks whose names contain this; the other records are not changed.
    #[arg(long)]
    only: Option<String>,
    /// Only checks that are not recorded at this commit and size; each is recorded when it ends, so that an interrupted
    /// run can continue.
    #[arg(long, conflicts_with_all = ["only", "quick"])]
    resume: bool,
    /// Combines the parts of a run of `cargo xtask evidence` in this folder.
    #[arg(long, hide = true)]
    gather: Option<PathBuf>,
    /// Golden figures whose names start with this may be recorded above the lowest value ever recorded.
    #[arg(long, value_delimiter = ',', requires = "because")]
    raise: Vec<String>,
    /// The reason: a defect that was fixed, or a feature that is worth it.
    #[arg(long, default_value = "")]
    because: String,
}

/// Measures, and writes the documents.
pub fn guarantees(options: &Options) -> Result<()> {
    let only = options.only.as_deref();
    if options.fit {
        return crate::checks::fit(only);
    }
    if options.render {
        return record::render();
    }
    let effort = if options.quick { Effort::TEST } else { Effort::FULL.divided(options.share) };
    let effort = Effort { fuzz_seconds: options.fuzz_seconds, ..effort };
    let raise = Raise { names: &options.raise, because: &options.because };
    if options.resume {
        return resume(&effort, raise);
    }
    if let Some(folder) = &options.gather {
        return pages::gather(folder, Run::now(Effort::RELEASE.size()), raise);
    }
    let mut steps = Steps::default();
    let measured = run(&effort, only, &mut steps);
    // A quick look leaves the full figures on record.
    if !options.quick {
        steps.run("documents", || record::write(&measured, raise).map(|()| Outcome::Passed));
    }
    steps.finish();
    Ok(())
}

/// Measures the checks that are not recorded at this commit and size, one after another.
fn resume(effort: &Effort, raise: Raise<'_>) -> Result<()> {
    let mut steps = Steps::default();
    for check in CHECKS {
        let now = Run::now(effort.size());
        ensure!(now.is_whole(), "commit first: the records say of which commit they are");
        if record::has(&record::committed()?, check, &now) {
            continue;
        }
        let mut measured = Measured::new(now);
        measured.run_each(effort, |name| name == check.name, &mut steps);
        steps.run("documents", || record::write(&measured, raise).map(|()| Outcome::Passed));
    }
    steps.finish();
    Ok(())
}

/// Runs the checks as steps of `cargo xtask test`, and compares their figures with the committed ones.
pub fn test(effort: &Effort, part: Option<Part>, steps: &mut Steps) {
    if part == Some(Part::Bindings) {
        let mut measured = Measured::new(Run::now(effort.size()));
        measured.run_each(effort, |name| BINDINGS.contains(&name), steps);
        return;
    }
    let left_out = if part.is_some() { &BINDINGS[..] } else { &[] };
    let measured = run_all(effort, left_out, steps);
    steps.run("figures within their bounds", || {
        record::compare(&measured).map(|()| Outcome::Passed)
    });
}

/// A part of the checks, whose job of CI fails apart.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Part {
    /// C and Python.
    Bindings,
    /// All others.
    Others,
}

/// The figures of a run, and the checks that could not run.
pub struct Measured {
    pub figures: Figures,
    pub skipped: Vec<&'static str>,
    pub run: Run,
}

impl Measured {
    /// No figures yet.
    fn new(run: Run) -> Self {
        Self { figures: Figures::default(), skipped: Vec::new(), run }
    }

    /// Runs the checks with the selected names, each as a step.
    fn run_each(&mut self, effort: &Effort, is_wanted: impl Fn(&str) -> bool, steps: &mut Steps) {
        for check in CHECKS.iter().filter(|check| is_wanted(check.name)) {
            steps.run(check.name, || {
                let outcome = if !effort.is_whole && ON_REQUEST.contains(&check.name) {
                    Outcome::Skipped("on request, `cargo xtask test --whole`".to_owned())
                } else {
                    (check.run)(effort, &mut self.figures)?
                };
                if matches!(outcome, Outcome::Skipped(_)) {
                    self.skipped.push(check.name);
                }
                let broken = check.broken(&self.figures);
                ensure!(broken.is_empty(), "{}", broken.join("\n"));
                Ok(outcome)
            });
        }
    }
}

/// Runs the checks: all, in two lanes, or those whose names contain `only`.
fn run(effort: &Effort, only: Option<&str>, steps: &mut Steps) -> Measured {
    let Some(only) = only else { return run_all(effort, &[], steps) };
    // Naming a check requests it.
    let effort = &Effort { is_whole: true, ..*effort };
    let mut measured = Measured::new(Run::now(effort.size()));
    measured.run_each(effort, |name| name.contains(only), steps);
    measured
}

/// Runs all checks but those left out, in two lanes.
fn run_all(effort: &Effort, left_out: &[&'static str], steps: &mut Steps) -> Measured {
    let mut measured = Measured::new(Run::now(effort.size()));
    measured.skipped.extend(left_out);
    let is_wanted = |name: &str| !left_out.contains(&name);
    let beside = Beside::start(effort, left_out);
    measured.run_each(effort, |name| is_wanted(name) && !BESIDE.contains(&name), steps);
    if let Err(error) = beside.and_then(|beside| beside.join(&mut measured, steps)) {
        steps.run("the checks beside", || Err(error));
    }
    measured
}

impl Check {
    /// The promises that the figures break, except those that need the records.
    fn broken(&self, figures: &Figures) -> Vec<String> {
        self.promises.iter().filter_map(|promise| promise.broken(figures)).collect()
    }
}

impl Promise {
    /// The broken promise of a measured figure, if any.
    pub fn broken(&self, figures: &Figures) -> Option<String> {
        let figure = figures.get(self.id)?;
        let other = |name: &str| figures.get(name)?.as_f64();
        // A text, or the null that JSON has for NaN, breaks every bound.
        let is_kept = match figure.as_f64() {
            Some(number) => self.bound.holds(number, other),
            None => matches!(self.bound, promise::Bound::Informs),
        };
        (!is_kept).then(|| format!("{} is {figure}, and must be {}", self.id, self.bound))
    }
}

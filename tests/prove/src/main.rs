//! Measures and proves: `cargo xtask demo | evidence | guarantees | profile | bound | rounding | mutants | coverage | processors` run this, and `test` its checks.
//! docs/proofs.md lists the file for each promise.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use dibs_prove::harness::{self, Effort};
use dibs_prove::{bound, coverage, demo, evidence, mutants, processors, profile};
use xtask::steps::{Outcome, Steps};

/// `cargo xtask` passes its arguments on to this.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Demo(demo::Options),
    Guarantees(harness::Options),
    Evidence(evidence::Options),
    /// Writes docs/evidence/performance.md: where a query's instructions go on the emulated board.
    Profile,
    Bound(bound::report::Options),
    /// Proves the rounding of the smallest kernels by Gappa, and checks the proofs by Coq.
    Rounding,
    Mutants(mutants::Options),
    Coverage(coverage::Options),
    /// Checks the core crate for every row of docs/processors.md.
    Processors,
    /// Runs the checks of `cargo xtask test`.
    #[command(hide = true)]
    Test {
        /// Seconds of the controller's time in the demo.
        #[arg(long)]
        demo_seconds: u32,
        /// Also the checks that run on request, and a few mutants of changed lines.
        #[arg(long)]
        whole: bool,
        /// Where to list the steps.
        #[arg(long)]
        steps: PathBuf,
        /// Only these checks; by default all.
        #[arg(long)]
        part: Option<harness::Part>,
    },
    /// Runs the checks of the second lane, for another process.
    #[command(hide = true)]
    Beside {
        /// The folder through which the two processes communicate.
        folder: PathBuf,
    },
}

fn main() -> ExitCode {
    let result = match Arguments::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Guarantees(options) => harness::guarantees(&options),
        Task::Evidence(options) => evidence::run(&options),
        Task::Profile => profile::run(),
        Task::Bound(options) => bound::report::run(&options),
        Task::Rounding => dibs_rounding::report(),
        Task::Mutants(options) => mutants::mutants(&options),
        Task::Coverage(options) => coverage::run(&options),
        Task::Processors => processors::check().map(|outcome| {
            if let Outcome::Skipped(reason) = outcome {
                println!("skipped: {reason}");
            }
        }),
        Task::Test { demo_seconds, whole, steps: file, part } => {
            let mut steps = Steps::default();
            let effort = Effort { demo_seconds, is_whole: whole, ..Effort::TEST };
            harness::test(&effort, part, &mut steps);
            let has_others = part != Some(harness::Part::Bindings);
            if has_others {
                steps.run("processors", processors::check);
            }
            if whole && has_others {
                steps.run("mutants of changed lines", mutants::sample);
            }
            steps.write(&file)
        }
        Task::Beside { folder } => harness::lanes::run(&folder),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

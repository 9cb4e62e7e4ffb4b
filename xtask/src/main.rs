//! `cargo xtask`: tasks that need more than cargo.

mod peers;
mod prove;
mod test;
mod viewer;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use prove::Passed;
use xtask::nightly;

/// Finds or installs the cross toolchain and the emulator if a task needs them. `DIBS_CROSS=rustup|debian|none` selects
/// one way to build for the board.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Streams a beating heart to the firmware, and checks every answer.
    #[command(disable_help_flag = true)]
    Demo(Passed),
    Test(test::Options),
    /// Runs the paper's experiments.
    #[command(disable_help_flag = true)]
    Bench(Passed),
    /// Queries other libraries through their Python packages, and writes docs/evidence/peers.json and
    /// docs/evidence/peers.md.
    #[command(disable_help_flag = true)]
    Peers(Passed),
    /// Measures every promise, and writes docs/evidence/guarantees.json and docs/evidence/guarantees.md.
    #[command(disable_help_flag = true)]
    Guarantees(Passed),
    /// Measures everything that docs/evidence shows in one run, and writes its pages.
    #[command(disable_help_flag = true)]
    Evidence(Passed),
    /// Writes docs/evidence/performance.md: where a query's instructions go on the emulated board.
    #[command(disable_help_flag = true)]
    Profile(Passed),
    /// Proves the most instructions of a query from the linked program, and writes docs/evidence/bound.md.
    #[command(disable_help_flag = true)]
    Bound(Passed),
    /// Proves the rounding of the smallest kernels by Gappa, and checks the proofs by Coq.
    #[command(disable_help_flag = true)]
    Rounding(Passed),
    Viewer(viewer::Options),
    Fuzz(nightly::FuzzOptions),
    /// Changes operators of the core one by one, and lists the changes that no test notices.
    #[command(disable_help_flag = true)]
    Mutants(Passed),
    /// Counts which statements and branches of the core its tests execute, and writes docs/evidence/coverage.md.
    #[command(disable_help_flag = true)]
    Coverage(Passed),
    /// Checks the core crate for every row of docs/processors.md.
    #[command(disable_help_flag = true)]
    Processors(Passed),
    /// Runs the tests of frames, bus and format under the address and the thread sanitizer.
    Sanitize,
    /// Runs the tests of the frames under Miri, if it is installed.
    Miri,
}

fn main() -> ExitCode {
    let result = match Arguments::parse().task {
        Task::Demo(passed) => prove::run("demo", &passed),
        Task::Test(options) => test::test(&options),
        Task::Bench(passed) => prove::bench(&passed),
        Task::Peers(passed) => peers::peers(&passed.arguments),
        Task::Guarantees(passed) => prove::run("guarantees", &passed),
        Task::Evidence(passed) => prove::evidence(&passed),
        Task::Profile(passed) => prove::run("profile", &passed),
        Task::Bound(passed) => prove::run("bound", &passed),
        Task::Rounding(passed) => prove::run("rounding", &passed),
        Task::Viewer(options) => viewer::viewer(&options),
        Task::Fuzz(options) => or_say(nightly::missing(), || nightly::fuzz_by_hand(&options)),
        Task::Mutants(passed) => prove::run("mutants", &passed),
        Task::Coverage(passed) => prove::run("coverage", &passed),
        Task::Processors(passed) => prove::run("processors", &passed),
        Task::Sanitize => or_say(nightly::missing(), nightly::sanitize_by_hand),
        Task::Miri => or_say(nightly::miri_missing(), nightly::miri),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a task, or prints why it cannot run here.
fn or_say(reason: Option<String>, task: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<()> {
    match reason {
        Some(reason) => {
            println!("skipped: {reason}");
            Ok(())
        }
        None => task(),
    }
}

//! `cargo xtask`: what needs more than cargo.

mod apt;
mod bench;
mod demo;
mod firmware;
mod guarantees;
mod nightly;
mod process;
mod qemu;
mod steps;
mod test;
mod toolchain;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Finds or installs the cross toolchain and the emulator where a task needs them.
/// `DIBS_CROSS=rustup|debian|none` forces one way to build for the board.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    Demo(demo::Options),
    Test(test::Options),
    Bench(bench::Options),
    Guarantees(guarantees::Options),
    /// Writes docs/performance.md: where a query's instructions go on the emulated board.
    Profile,
    Fuzz(nightly::FuzzOptions),
    /// Runs the tests of frames, bus and format under the address and the thread sanitizer.
    Sanitize,
    /// Runs the tests of the frames under Miri, where it is installed.
    Miri,
}

fn main() -> ExitCode {
    let result = match Arguments::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Test(options) => test::test(&options),
        Task::Bench(options) => bench::run(&options),
        Task::Guarantees(options) => guarantees::run(&options),
        Task::Profile => guarantees::profile::run(),
        Task::Fuzz(options) => or_say(nightly::missing(), || nightly::fuzz_by_hand(&options)),
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

/// Runs a task, or says why it cannot run here.
fn or_say(reason: Option<String>, task: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<()> {
    match reason {
        Some(reason) => {
            println!("skipped: {reason}");
            Ok(())
        }
        None => task(),
    }
}

//! `cargo xtask`: what needs more than cargo.

mod apt;
mod bench;
mod demo;
mod firmware;
mod guarantees;
mod process;
mod qemu;
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
}

fn main() -> ExitCode {
    let result = match Arguments::parse().task {
        Task::Demo(options) => demo::run(&options),
        Task::Test(options) => test::test(&options),
        Task::Bench(options) => bench::run(&options),
        Task::Guarantees(options) => guarantees::run(&options),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

//! Runs `tests/prove`, the program that measures and proves.

use std::process::Command;

use anyhow::Result;
use xtask::{process, workspace};

/// Arguments that are passed on as they are.
#[derive(clap::Args)]
pub struct Passed {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// `cargo run` of the program, without its arguments. It runs in the user's folder, because arguments may be paths.
pub fn command(features: &[&str]) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.args(["run", "--release", "--package", "dibs-prove", "--manifest-path"]);
    cargo.arg(workspace::root().join("Cargo.toml")).args(features).arg("--");
    cargo
}

/// The program, built together with the whole workspace and its tests: a build of it alone would compile its
/// dependencies again, with fewer features.
pub fn with_workspace() -> Result<Command> {
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--quiet", "--release", "--workspace", "--bins", "--tests"]);
    process::run(cargo.current_dir(workspace::root()))?;
    Ok(Command::new(workspace::target().join("release/prove")))
}

/// Runs a task of the program.
pub fn run(task: &str, passed: &Passed) -> Result<()> {
    end(command(&[]).arg(task).args(&passed.arguments))
}

/// Runs the demo, which needs none of the peers of the benchmark.
pub fn demo(passed: &Passed) -> Result<()> {
    end(command(&["--no-default-features"]).arg("demo").args(&passed.arguments))
}

/// Runs a program that prints its error, and exits with its code.
fn end(command: &mut Command) -> Result<()> {
    match command.status()?.code() {
        Some(0) => Ok(()),
        code => std::process::exit(code.unwrap_or(1)),
    }
}

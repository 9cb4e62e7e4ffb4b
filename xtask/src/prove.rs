//! Runs `tests/prove`, the program that measures and proves, and `tests/bench`, which has the paper's experiments.

use std::process::Command;

use anyhow::Result;
use xtask::workspace;

/// The crate that also contains other libraries, for comparison.
const BENCH: &str = "dibs-bench";

/// Arguments that are passed on unchanged.
#[derive(clap::Args)]
pub struct Passed {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<String>,
}

/// `cargo run` of a program, without its arguments. It runs in the user's folder, because arguments may be paths.
fn command(package: &str) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.args(["run", "--release", "--package", package, "--manifest-path"]);
    cargo.arg(workspace::root().join("Cargo.toml")).arg("--");
    cargo
}

/// The program, built together with the whole workspace.
pub fn with_workspace() -> Result<Command> {
    workspace::build()?;
    let mut prove = Command::new(workspace::target().join("release/prove"));
    prove.envs([workspace::IS_BUILT]);
    Ok(prove)
}

/// Runs a task of the program.
pub fn run(task: &str, passed: &Passed) -> Result<()> {
    end(command("dibs-prove").arg(task).args(&passed.arguments))
}

/// Measures all evidence. Everything is built first, so that no part is slow, or timed, for a compilation beside it.
pub fn evidence(passed: &Passed) -> Result<()> {
    let mut prove = with_workspace()?;
    let mut build = Command::new("cargo");
    build.args(["build", "--quiet", "--release", "--package", BENCH]);
    xtask::process::run(build.current_dir(workspace::root()))?;
    end(prove.arg("evidence").args(&passed.arguments))
}

/// Runs the paper's experiments.
pub fn bench(passed: &Passed) -> Result<()> {
    end(command(BENCH).args(&passed.arguments))
}

/// Runs a program that prints its own errors, and exits with its code.
fn end(command: &mut Command) -> Result<()> {
    match command.status()?.code() {
        Some(0) => Ok(()),
        code => std::process::exit(code.unwrap_or(1)),
    }
}

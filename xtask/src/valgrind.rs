//! Callgrind, and the runner of the benches that count with it.

use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result};

use crate::apt;
use crate::process::{quiet, run};

/// Version of the benches' runner: it must be the library's version.
const RUNNER: &str = "0.20.0";

/// Finds valgrind, or installs it.
///
/// # Errors
/// If it can be neither found nor installed.
pub fn find() -> Result<()> {
    let version = quiet(Command::new("valgrind").arg("--version"), Duration::from_secs(20));
    if version.is_err() {
        apt::install(&["valgrind"]).context("no valgrind: sudo apt-get install valgrind")?;
    }
    Ok(())
}

/// Finds valgrind and the runner of its benches, or installs them.
///
/// # Errors
/// If they can be neither found nor installed.
pub fn install_runner() -> Result<()> {
    find()?;
    let runner = Command::new("gungraun-runner").stdin(Stdio::null()).output();
    if runner.is_err() {
        let mut cargo = Command::new("cargo");
        cargo.args(["install", "--quiet", "gungraun-runner", "--version", RUNNER, "--locked"]);
        run(&mut cargo).context("no gungraun-runner")?;
    }
    Ok(())
}

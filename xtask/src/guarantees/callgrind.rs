//! Instructions of the hot functions on this computer, by callgrind.

use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::figures::Figures;
use crate::process::{quiet, run, shown};
use crate::{apt, workspace};

/// Version of the benches' runner, which must be that of the library.
const RUNNER: &str = "0.20.0";

/// Counts the instructions of every function in `tests/benches/instructions.rs`.
pub fn check(figures: &mut Figures) -> Result<()> {
    install()?;
    let mut cargo = Command::new("cargo");
    cargo.args(["bench", "--quiet", "--package", "dibs-tests", "--bench", "instructions"]);
    cargo.args(["--", "--output-format=json"]).current_dir(workspace::root());
    let output = cargo.stderr(Stdio::inherit()).output()?;
    ensure!(output.status.success(), "`{}` failed", shown(&cargo));
    let text = String::from_utf8(output.stdout)?;
    for line in text.lines().filter(|line| line.starts_with('{')) {
        let bench: Value = serde_json::from_str(line)?;
        let name = [&bench["function_name"], &bench["id"]].map(|v| v.as_str().unwrap_or_default());
        let count = &bench["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"];
        let count = count.as_f64().with_context(|| format!("no instructions in {line}"))?;
        figures.note(&format!("host.{}.{}", name[0], name[1]), count);
    }
    Ok(())
}

/// Finds valgrind, or installs it.
pub fn find() -> Result<()> {
    let version = quiet(Command::new("valgrind").arg("--version"), Duration::from_secs(20));
    if version.is_err() {
        apt::install(&["valgrind"]).context("no valgrind: sudo apt-get install valgrind")?;
    }
    Ok(())
}

/// Finds valgrind and the runner of its benches, or installs them.
fn install() -> Result<()> {
    find()?;
    let runner = Command::new("gungraun-runner").stdin(Stdio::null()).output();
    if runner.is_err() {
        let mut cargo = Command::new("cargo");
        cargo.args(["install", "--quiet", "gungraun-runner", "--version", RUNNER, "--locked"]);
        run(&mut cargo).context("no gungraun-runner")?;
    }
    Ok(())
}

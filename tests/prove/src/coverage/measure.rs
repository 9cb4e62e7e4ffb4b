//! Builds the tests with counters, runs them, and exports what was counted.

// Requirement: E-06

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xtask::process::{quiet, run};
use xtask::workspace;

use super::export::Export;
use crate::harness::run::Run;

/// The packages that are compiled with counters: the core, and the tests that instantiate its generic functions.
const COUNTED: [&str; 2] = ["dibs-nostd", "dibs-tests"];

/// The test programs, by cargo's arguments.
const PROGRAMS: [&[&str]; 5] = [
    &["--lib"],
    &["--test", "bus"],
    &["--test", "surface"],
    &["--test", "tree"],
    &["--test", "query"],
];

const MOMENT: Duration = Duration::from_secs(120);

/// The nightly compiler's version.
fn compiler() -> Result<String> {
    let said = quiet(Command::new("rustc").args(["+nightly", "--version"]), MOMENT)?;
    Ok(said.trim().to_owned())
}

/// Where the counts are, and the run that they are of.
fn places() -> (PathBuf, PathBuf) {
    let folder = workspace::target().join("coverage");
    (folder.join("counts"), folder.join("run.json"))
}

/// Runs the tests, one program after the other, and keeps what they counted.
pub fn count() -> Result<()> {
    let (counts, of) = places();
    if counts.exists() {
        fs::remove_dir_all(&counts)?;
    }
    fs::create_dir_all(&counts)?;
    let run_now = Run { compiler: compiler()?, ..Run::now("full".to_owned()) };
    let steps = PROGRAMS.len() + 1;
    eprintln!("1 of {steps}: building the tests with counters ...");
    built()?;
    for (number, arguments) in (2..).zip(PROGRAMS) {
        eprintln!("{number} of {steps}: the tests of {} ...", arguments.last().unwrap_or(&""));
        let start = Instant::now();
        let mut cargo = cargo();
        cargo.args(arguments).env("LLVM_PROFILE_FILE", counts.join("%p-%m.profraw"));
        // Cargo prints no more than the tests do.
        run(cargo.arg("--quiet"))?;
        eprintln!("    {:.0} s", start.elapsed().as_secs_f64());
    }
    fs::write(of, serde_json::to_string(&run_now)?)?;
    Ok(())
}

/// What the last run counted, and the run.
pub fn exported() -> Result<(Run, Vec<Export>)> {
    let (counts, of) = places();
    let text = fs::read_to_string(&of).context("nothing was counted yet")?;
    let mut raw = Vec::new();
    for entry in fs::read_dir(&counts)? {
        raw.push(entry?.path());
    }
    ensure!(!raw.is_empty(), "the tests left no counts in {}", counts.display());
    let [profdata, cov] = tools()?;
    let merged = counts.with_extension("profdata");
    let mut merge = Command::new(&profdata);
    run(merge.args(["merge", "--sparse", "-o"]).arg(&merged).args(&raw))?;
    // One by one: of several, llvm-cov takes a function from the first, where it may have no instance.
    let mut exports = Vec::new();
    for program in built()? {
        let mut export = Command::new(&cov);
        export.args(["export", "--format=text", "--skip-functions", "--skip-expansions"]);
        export.arg("--instr-profile").arg(&merged).arg(program).arg("--sources").arg(core());
        let counted = quiet(&mut export, Duration::from_secs(600))?;
        exports.push(serde_json::from_str(&counted)?);
    }
    Ok((serde_json::from_str(&text)?, exports))
}

/// The sources that are counted.
pub fn core() -> PathBuf {
    workspace::root().join("dibs-nostd/src")
}

/// `cargo test` of the nightly compiler, with counters in some packages. Build scripts have none of their own.
fn cargo() -> Command {
    let mut cargo = Command::new("cargo");
    cargo.current_dir(workspace::root());
    cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
    cargo.args(["+nightly", "-Zprofile-rustflags", "test", "--release"]);
    cargo.arg("--target-dir").arg(workspace::target().join("coverage"));
    for package in COUNTED {
        let flags = "[\"-Cinstrument-coverage\",\"-Zcoverage-options=branch\"]";
        cargo.args(["--package", package, "--config"]);
        cargo.arg(format!("profile.release.package.{package}.rustflags={flags}"));
    }
    cargo
}

/// Builds the tests, and returns their programs.
fn built() -> Result<Vec<PathBuf>> {
    let mut cargo = cargo();
    cargo.args(PROGRAMS.concat()).args(["--no-run", "--message-format=json"]);
    // The build scripts of both packages count, too: not among the tests.
    cargo.env("LLVM_PROFILE_FILE", workspace::target().join("coverage/scripts/%p.profraw"));
    cargo.stderr(std::process::Stdio::inherit());
    let output = cargo.output().context("cannot start cargo")?;
    ensure!(output.status.success(), "the tests do not build with counters");
    let text = String::from_utf8_lossy(&output.stdout);
    let messages = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let programs: Vec<PathBuf> = messages
        .filter(|message| message["profile"]["test"] == true)
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .collect();
    ensure!(programs.len() >= PROGRAMS.len(), "only {} programs of tests", programs.len());
    Ok(programs)
}

/// `llvm-profdata` and `llvm-cov` of the nightly compiler, which is asked for them if they are missing.
fn tools() -> Result<[PathBuf; 2]> {
    let said = quiet(Command::new("rustc").args(["+nightly", "--print", "target-libdir"]), MOMENT)?;
    let folder = PathBuf::from(said.trim()).with_file_name("bin");
    let tools = ["llvm-profdata", "llvm-cov"].map(|name| folder.join(name));
    if !tools.iter().all(|tool| tool.exists()) {
        let component = ["component", "add", "llvm-tools", "--toolchain", "nightly"];
        quiet(Command::new("rustup").args(component), Duration::from_secs(300))
            .context("no llvm-tools (rustup component add llvm-tools --toolchain nightly)")?;
    }
    Ok(tools)
}

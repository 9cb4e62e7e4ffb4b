//! The parts of the run: everything that writes below docs/evidence.

use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use xtask::process::{run, shown};
use xtask::steps::Outcome;
use xtask::{apt, python, workspace};

use super::pages::{Write, Writer};
use super::runner::{FILES, PARTS, Part, Place};
use crate::checks::{BESIDE, CHECKS, EITHER};
use crate::data;
use crate::harness::{Check, Effort, lanes};

pub const NOT_OF_THE_RUN: &str = "peers.json and peers.md (`cargo xtask peers`, other libraries), coverage.json and coverage.md (`cargo xtask coverage`), \
     the two demos with a bridge (demo/bridge, demo/bridge-nodes), walks.md (people), README.md.";

/// A part that takes longer than this is ended.
const LIMIT: Duration = Duration::from_mins(25);

/// Of the benchmark, in the order of the records: its argument of `--only`.
const BENCHMARKS: [(&str, Place); 5] = [
    ("paper", Place::Alone),
    ("imaging", Place::Alone),
    ("embedded", Place::Alone),
    ("contacts", Place::Alone),
    ("tracker", Place::Emulator),
];

/// What `dibs bridge` is tried with: its record's page names their versions.
const PYTHON: [&str; 7] = [
    "numpy",
    "pyigtl",
    "ros-rclpy",
    "ros-rmw-fastrtps-cpp",
    "ros-sensor-msgs",
    "ros-shape-msgs",
    "cryptography",
];

/// All parts.
pub fn all() -> Result<Vec<Part>> {
    // Found once: cargo replaces the file when it builds.
    let program = env::current_exe()?;
    let mut parts: Vec<Part> = CHECKS.iter().map(|check| of_check(check, &program)).collect();
    parts.push(real_heart(program));
    parts.push(Part::new("compile time", Place::Beside, |folder| {
        let mut cargo = cargo(&["bench", "--quiet", "-p", "dibs-bench", "--bench", "compile_time"]);
        cargo.args(["--", "--write"]).env("DIBS_FOLDER", workspace::target().join("compile-time"));
        logged(&mut cargo, folder)
    }));
    for (name, place) in BENCHMARKS {
        parts.push(Part::new(&benchmark(name), place, move |folder| {
            let mut cargo = bench();
            logged(cargo.args(["--release", "--only", name, "--out"]).arg(folder), folder)
        }));
    }
    parts.push(Part::new("bridge", Place::Alone, bridge));
    Ok(parts)
}

/// What makes pages from the parts, in this order.
pub fn writers(folder: &Path, raise: &[String], because: &str) -> Result<Vec<Writer>> {
    let program = env::current_exe()?;
    let (guarantees, profile) = (program.clone(), program);
    let parts = folder.to_path_buf();
    let raise = raise.join(",");
    let raised = if raise.is_empty() {
        Vec::new()
    } else {
        ["--raise", &raise, "--because", because].map(str::to_owned).to_vec()
    };
    let all = folder.to_path_buf();
    let writer = |name, write: Box<Write>| Writer { name, write };
    Ok(vec![
        writer("benchmarks", Box::new(move |pages| benchmarks(&all, pages))),
        writer(
            "guarantees",
            Box::new(move |pages| {
                let mut prove = into(Command::new(&guarantees), pages);
                run(prove.args(["guarantees", "--gather"]).arg(&parts).args(&raised))
            }),
        ),
        writer(
            "where instructions go",
            Box::new(move |pages| run(into(Command::new(&profile), pages).arg("profile"))),
        ),
        writer(
            "pages of sources",
            Box::new(|pages| {
                // The README is no page of the run: `--release` writes its figures.
                let test =
                    ["test", "--release", "--quiet", "--test", "pages", "--", "--skip", "readme"];
                run(into(cargo(&test), pages).env("DIBS_WRITE", "1"))
            }),
        ),
    ])
}

fn of_check(check: &'static Check, program: &Path) -> Part {
    let program = program.to_path_buf();
    let place = match check.name {
        name if BESIDE.contains(&name) => Place::Beside,
        name if EITHER.contains(&name) => Place::Either,
        _ => Place::Emulator,
    };
    Part::new(check.name, place, move |folder| {
        let mut prove = lanes::command(&program, folder, &Effort::RELEASE, &[check.name])?;
        logged(&mut prove, folder)?;
        lanes::outcome(folder, check)
    })
}

/// The demo with a human heart.
fn real_heart(program: PathBuf) -> Part {
    Part::new("demo with a human heart", Place::Emulator, move |folder| {
        let data = data::real().context("no human heart beside the repository")?;
        let mut prove = Command::new(&program);
        prove.args(["demo", "--script", "--seconds", &Effort::RELEASE.demo_seconds.to_string()]);
        prove.arg("--mesh").arg(data.join("heart_10272.ply"));
        prove.arg("--motion").arg(data.join("heart_10272.pc2"));
        // At the 25 frames a second of a beat it is faster than the controller's limit, which is the generated heart's.
        prove.args(["--motion-rate", "10"]);
        prove.arg("--output").arg(folder.join(FILES).join("demo/real-heart"));
        logged(&mut prove, folder)
    })
}

fn benchmark(name: &str) -> String {
    format!("benchmark {name}")
}

/// The records of all benchmarks, and the pages made from them.
fn benchmarks(folder: &Path, pages: &Path) -> Result<()> {
    let mut records: Vec<Value> = Vec::new();
    for (name, _) in BENCHMARKS {
        let place = folder.join(PARTS).join(benchmark(name).replace(' ', "-"));
        let text = fs::read_to_string(place.join("benchmarks.json"))?;
        records.append(&mut serde_json::from_str(&text)?);
    }
    fs::write(pages.join("benchmarks.json"), serde_json::to_string(&records)?)?;
    run(bench().args(["--render", "--out"]).arg(pages))
}

/// `dibs bridge` beside other libraries.
fn bridge(folder: &Path) -> Result<Outcome> {
    let venv = workspace::target().join("bridge");
    let python = python::environment(&venv.join("venv"), &PYTHON)?;
    if !Path::new("/usr/include/openigtlink").is_dir() {
        apt::install(&["libopenigtlink-dev", "g++"])?;
    }
    let mut cargo = cargo(&["test", "--release", "--quiet", "--test", "cli", "--"]);
    cargo.args(["--ignored", "bridge_is_recorded"]).env("DIBS_WRITE", "1");
    cargo.env("DIBS_PYIGTL", &python).env("DIBS_RCLPY", &python);
    cargo.env("PYTHONPATH", python::package(&venv.join("package"))?);
    logged(&mut cargo, folder)?;
    // The page's last section is this test's.
    let mut messages = self::cargo(&["test", "--release", "--quiet", "--package", "dibs-cli"]);
    messages.arg("no_vertex_is_taken_for_another");
    logged(messages.env("DIBS_FRAMES", "1000000").env("DIBS_WRITE", "1"), folder)
}

fn bench() -> Command {
    cargo(&["run", "--release", "--quiet", "--package", "dibs-bench", "--"])
}

fn cargo(arguments: &[&str]) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.args(arguments).current_dir(workspace::root());
    cargo
}

/// A command that writes its pages and records into this folder.
fn into(mut command: Command, pages: &Path) -> Command {
    command.env(workspace::EVIDENCE, pages);
    command
}

/// Runs the command of a part. What it says goes to a file.
fn logged(command: &mut Command, folder: &Path) -> Result<Outcome> {
    let log = folder.join("log.txt");
    let file = File::create(&log)?;
    command.env(workspace::EVIDENCE, folder.join(FILES));
    let name = shown(command);
    let mut child = command.stdout(file.try_clone()?).stderr(file).spawn()?;
    let end = Instant::now() + LIMIT;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if Instant::now() > end {
            child.kill()?;
            child.wait()?;
            bail!("it did not end within {} min: {}", LIMIT.as_secs() / 60, log.display());
        }
        thread::sleep(Duration::from_millis(100));
    };
    let said = || String::from_utf8_lossy(&fs::read(&log).unwrap_or_default()).into_owned();
    let last = |said: String| said.lines().rfind(|line| !line.trim().is_empty()).map(str::to_owned);
    ensure!(
        status.success(),
        "`{name}`: {status}: {} ({})",
        last(said()).unwrap_or_default(),
        log.display()
    );
    Ok(Outcome::Passed)
}

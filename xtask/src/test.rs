//! `cargo xtask test`: what CI runs, but for mutants and advisories.

// Requirement: E-04

use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, ensure};
use xtask::c_interface;
use xtask::process::{quiet, run};
use xtask::qemu;
use xtask::steps::{Outcome, Steps};
use xtask::toolchain::Cross;
use xtask::twice;
use xtask::workspace;

use crate::{prove, viewer};

/// Runs every check: format, lints, documentation, tests, oldest compiler, the board's build, and a
/// short demo on the emulated board.
#[derive(clap::Args)]
pub struct Options {
    /// Seconds of the controller's time in the demo.
    #[arg(long, default_value_t = 5)]
    pub demo_seconds: u32,
    /// Also the slow tests: a new user's path from an empty crate to an answer on the board by the guide, the firmware
    /// built again in another folder, the viewer's tests and its query in WebAssembly, small runs of the paper's
    /// experiments, a filter, an embedded organ, modal ticks and a flood on the board, other processors, the
    /// sanitizers, the fuzzers, and all cases of tests that otherwise run a quarter.
    #[arg(long)]
    pub whole: bool,
    /// Only these steps, for machines that run in parallel; by default all.
    #[arg(long)]
    pub job: Option<Job>,
}

/// Groups of steps.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Job {
    /// Format and lints.
    Lints,
    /// Tests on this computer.
    Host,
    /// Documentation, packages, and the oldest compiler.
    Docs,
    /// Builds for the board and for WebAssembly.
    Board,
    /// C on this computer and on the board, and Python.
    Bindings,
    /// The checks of every promise: emulated boards, demo, sanitizers.
    Promises,
}

/// Runs all steps of the job, even after a failure, and lists them at the end.
pub fn test(options: &Options) -> Result<()> {
    let mut steps = Steps::default();
    let is_due = |job| options.job.is_none_or(|only| only == job);
    let (seconds, is_whole) = (options.demo_seconds, options.whole);
    if is_due(Job::Lints) {
        lints(&mut steps, is_whole);
    }
    let has_checks = is_due(Job::Bindings) || is_due(Job::Promises);
    if is_due(Job::Host) || has_checks {
        steps.run("build", || workspace::build().map(|()| Outcome::Passed));
    }
    // Found first, because otherwise all threads would install them.
    let found = (is_due(Job::Board) || has_checks)
        .then(|| Cross::find().and_then(|cross| qemu::find().map(|_| cross)));
    // Threads, because tests, builds and emulators each leave a core idle at times.
    let part = match options.job {
        Some(Job::Bindings) => &["--part", "bindings"][..],
        Some(_) => &["--part", "others"],
        None => &[],
    };
    let checks = has_checks.then(|| thread::spawn(move || checks(seconds, is_whole, part)));
    let board = found
        .filter(|_| is_due(Job::Board))
        .map(|found| thread::spawn(move || board(found, is_whole)));
    if is_due(Job::Host) {
        // This also runs the examples in the documentation.
        let tests = ["test", "--release", "--no-fail-fast"];
        let variables = [workspace::IS_BUILT, ("DIBS_WHOLE", "1")];
        let variables = if is_whole { &variables[..] } else { &variables[..1] };
        steps.cargo("tests", &[&tests, bench_too(is_whole)].concat(), variables);
        steps.run("files of other programs", other_programs);
    }
    // Without a job they are among the tests.
    if options.job == Some(Job::Bindings) {
        steps.cargo("C interface", &["test", "--release", "-p", "dibs-c"], &[workspace::IS_BUILT]);
    }
    if is_due(Job::Docs) {
        documents(&mut steps);
    }
    if let Some(board) = board {
        match board.join() {
            Ok(board) => steps.append(board),
            Err(_) => steps.run("board", || Err(panicked())),
        }
    }
    if let Some(checks) = checks {
        let list = checks.join().unwrap_or_else(|_| Err(panicked()));
        if let Err(error) = list.and_then(|list| steps.read(&list)) {
            steps.run("checks of tests/prove", || Err(error));
        }
    }
    steps.finish();
    Ok(())
}

fn panicked() -> anyhow::Error {
    anyhow!("the thread panicked")
}

/// The paper's experiments are not a default member of the workspace: they are compiled and run only with `--whole`.
const fn bench_too(is_whole: bool) -> &'static [&'static str] {
    if is_whole { &["--workspace"] } else { &[] }
}

fn lints(steps: &mut Steps, is_whole: bool) {
    steps.cargo("format", &["fmt", "--all", "--check"], &[]);
    let board = ["fmt", "--check", "--manifest-path", "examples/stm32h743/Cargo.toml"];
    steps.cargo("format of the board apart", &board, &[]);
    // Lints and documentation use the tests' profile, so that common dependencies are built once.
    let lints = ["clippy", "--release", "--all-targets"];
    let lints = [&lints, bench_too(is_whole), &["--", "-D", "warnings"]].concat();
    steps.cargo("lints", &lints, &[]);
}

fn documents(steps: &mut Steps) {
    let strict = [("RUSTDOCFLAGS", "-D warnings")];
    let doc = ["doc", "--release", "--no-deps", "-p"];
    let libraries = ["dibs-nostd", "-p", "dibs-build", "-p", "dibs-stream", "--all-features"];
    steps.cargo("documentation", &[&doc[..], &libraries].concat(), &strict);
    steps.cargo(
        "documentation of the firmware",
        &[&doc[..], &["firmware-example"]].concat(),
        &strict,
    );
    let published = ["dibs-nostd", "dibs-build", "dibs-stream", "dibs-cli"];
    let published = published.iter().flat_map(|name| ["-p", name]);
    let package = ["package", "--no-verify", "--allow-dirty"].into_iter().chain(published);
    steps.cargo("packages", &package.collect::<Vec<_>>(), &[]);
    steps.run("oldest compiler", oldest_compiler);
}

fn board(found: Result<Cross>, is_whole: bool) -> Steps {
    let mut steps = Steps::default();
    match found {
        Ok(cross) => {
            println!("\nboard: {}", cross.describe());
            steps.run("core crate for the board", || core_crate(&cross));
            steps.run("lints of the firmware", || firmware_lints(&cross, is_whole));
            steps.run("C interface for the board", || c_interface::has_no_panic_path(&cross));
            if is_whole {
                steps.run("a new user", || new_user(&cross));
                steps.run("the same firmware in another folder", || {
                    twice::same_bytes(&cross).map(|()| Outcome::Passed)
                });
            }
            steps.run("cycles, as far as an emulator has them", || cycles(&cross));
        }
        Err(error) => steps.run("toolchain for the board", || Err(error)),
    }
    steps.run("viewer for WebAssembly", viewer::compiles);
    if is_whole {
        steps.run("viewer in WebAssembly", viewer::same_bits);
    }
    steps
}

/// Runs the checks of `tests/prove`. Returns the file with the list of its steps.
fn checks(demo_seconds: u32, is_whole: bool, part: &[&str]) -> Result<PathBuf> {
    let list = workspace::target().join("steps.txt");
    // A list of an earlier run must not be mistaken for this run's.
    std::fs::write(&list, "")?;
    let mut prove = prove::with_workspace()?;
    prove.args(["test", "--demo-seconds", &demo_seconds.to_string(), "--steps"]).arg(&list);
    prove.args(part);
    if is_whole {
        prove.arg("--whole");
    }
    run(&mut prove)?;
    Ok(list)
}

/// Compares with files that other programs write, if they are installed.
fn other_programs() -> Result<Outcome> {
    let mut command = Command::new("cargo");
    // All packages, so that cargo reuses the build of the tests.
    command.args([
        "test",
        "--release",
        "--quiet",
        "--test",
        "readers",
        "written_by_other_programs",
    ]);
    command.args(["--", "--ignored", "--nocapture"]);
    let output = command.current_dir(workspace::root()).output()?;
    let said =
        [output.stdout, output.stderr].map(|said| String::from_utf8_lossy(&said).into_owned());
    let lines = || said.iter().flat_map(|said| said.lines());
    if output.status.success() {
        let is_report = |line: &&str| line.starts_with("read ") || line.starts_with("skipped: ");
        lines().filter(is_report).for_each(|line| println!("{line}"));
        return Ok(Outcome::Passed);
    }
    match lines().find_map(|line| line.split_once("skipped: ")) {
        Some((_, reason)) => Ok(Outcome::Skipped(reason.to_owned())),
        None => Err(anyhow!("{}", said.concat())),
    }
}

/// `cargo check` with the compiler that `rust-version` names, which rustup installs if it is not there.
fn oldest_compiler() -> Result<Outcome> {
    let version = env!("CARGO_PKG_RUST_VERSION");
    let in_use = quiet(Command::new("rustc").arg("--version"), Duration::from_secs(20))?;
    if in_use.strip_prefix("rustc ").is_some_and(|name| name.starts_with(&format!("{version}."))) {
        println!("all steps above ran with it: {}", in_use.trim());
        return Ok(Outcome::Passed);
    }
    if quiet(Command::new("rustup").arg("--version"), Duration::from_secs(20)).is_err() {
        return Ok(Outcome::Skipped(format!("neither rustup nor Rust {version} is here")));
    }
    let mut command = Command::new("rustup");
    command.args(["run", "--install", version, "cargo", "check", "--quiet", "--target-dir"]);
    command.arg(workspace::target().join("oldest"));
    command.env_remove("CARGO").env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
    run(command.current_dir(workspace::root())).map(|()| Outcome::Passed)
}

/// The core crate compiles for the board with only `core`: with all layers and the traits of other crates, and with
/// each smaller set of layers.
fn core_crate(cross: &Cross) -> Result<Outcome> {
    // The firmware's profile, because its dependencies are needed anyway.
    let check = || {
        let mut check = cross.cargo("check");
        check.args(["--quiet", "--profile", "firmware", "--package", "dibs-nostd"]);
        check
    };
    run(check().args(["--features", "defmt,embedded-can,embedded-io,mint,serde"]))?;
    for layer in [
        "",
        "batched",
        "bus",
        "control",
        "modes",
        "nodes",
        "control,bus",
        "control,modes",
        "bus,modes",
        "bus,nodes",
    ] {
        run(check().args(["--no-default-features", "--features", layer]))
            .with_context(|| format!("dibs-nostd with only the layers \"{layer}\""))?;
    }
    Ok(Outcome::Passed)
}

fn firmware_lints(cross: &Cross, is_whole: bool) -> Result<Outcome> {
    if !matches!(cross, Cross::Rustup) {
        return Ok(Outcome::Skipped("Debian's compiler comes without clippy".to_owned()));
    }
    for program in ["board", "cycles"] {
        let mut command = cross.cargo("clippy");
        command.args(["--quiet", "--package", "firmware-example", "--bin", program]);
        command.args(["--features", program, "--profile", "firmware", "--", "-D", "warnings"]);
        run(&mut command)?;
    }
    // Checking the drivers would take as long again as building them.
    let buses: &[&[&str]] = &[&[], &["--features", "fdcan"]];
    for bus in buses.iter().filter(|_| is_whole) {
        let mut command = cross.cargo_apart("examples/stm32h743", "clippy");
        run(command.args(["--quiet", "--release"]).args(*bus).args(["--", "-D", "warnings"]))?;
    }
    Ok(Outcome::Passed)
}

/// Follows the guide from an empty crate outside the repository to an answer on the board.
fn new_user(cross: &Cross) -> Result<Outcome> {
    if !matches!(cross, Cross::Rustup) {
        return Ok(Outcome::Skipped("the guide takes rustup's target".to_owned()));
    }
    let mut command = Command::new("cargo");
    command.args(["test", "--release", "--package", "dibs-tests", "--test", "pages", "new_user"]);
    run(command.args(["--", "--ignored"])).map(|()| Outcome::Passed)
}

/// Runs the program that measures cycles on real hardware. In the emulator the cycle counter does not count, and the
/// program uses `SysTick` instead; it must still end and print constants.
fn cycles(cross: &Cross) -> Result<Outcome> {
    let mut cargo = cross.cargo("build");
    cargo.args(["--quiet", "--package", "firmware-example", "--bin", "cycles"]);
    run(cargo.args(["--features", "cycles", "--profile", "firmware"]))?;
    let program = cross.program("firmware", "cycles");
    let said = quiet(&mut qemu::alone(&program, qemu::BOARD, &[]), Duration::from_mins(2))?;
    print!("{said}");
    ensure!(said.contains("the cycle counter stands still"), "the emulator counts cycles");
    ensure!(!said.contains("base: 0,") && said.contains("Cost {"), "no cost was measured");
    Ok(Outcome::Passed)
}

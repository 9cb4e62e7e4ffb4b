//! `cargo xtask test`: everything that CI runs.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

use crate::demo;
use crate::firmware::{self, Footprint, Surface};
use crate::process::{quiet, run};
use crate::toolchain::Cross;
use crate::workspace;

/// Runs every check: format, lints, documentation, tests, oldest compiler, the board's build, and a
/// short demo on the emulated board.
#[derive(clap::Args)]
pub struct Options {
    /// Seconds of the controller's time in the demo.
    #[arg(long, default_value_t = 5)]
    pub demo_seconds: u32,
}

/// What a step came to.
enum Outcome {
    Passed,
    /// It could not run here; the reason.
    Skipped(String),
}

/// The steps so far.
#[derive(Default)]
struct Steps {
    lines: Vec<String>,
    passed: usize,
    failed: usize,
}

/// Runs all steps, whatever fails, and lists them at the end.
pub fn test(options: &Options) -> Result<()> {
    let mut steps = Steps::default();
    let workspace = ["--workspace", "--all-targets"];
    steps.cargo("format", &["fmt", "--all", "--check"], &[]);
    steps.cargo("lints", &[&["clippy"], &workspace[..], &["--", "-D", "warnings"]].concat(), &[]);
    steps.cargo("plain build", &["build"], &[]);
    steps.cargo("tests", &[&["test", "--release", "--no-fail-fast"], &workspace[..]].concat(), &[]);
    steps.cargo("documentation examples", &["test", "--release", "--workspace", "--doc"], &[]);
    steps.cargo(
        "documentation",
        &["doc", "--workspace", "--no-deps"],
        &[("RUSTDOCFLAGS", "-D warnings")],
    );
    steps.run("oldest compiler", oldest_compiler);

    match Cross::find() {
        Ok(cross) => {
            println!("\nboard: {}", cross.describe());
            steps.run("core crate for the board", || core_crate(&cross));
            steps.run("lints of the firmware", || firmware_lints(&cross));
            steps.run("firmware without panic and allocator", || firmware_build(&cross));
        }
        Err(error) => steps.run("toolchain for the board", || Err(error)),
    }
    steps.run("demo on the emulated board", || demo_on_board(options.demo_seconds));
    steps.run("demo on this computer", || demo_on_host(options.demo_seconds));
    steps.finish()
}

impl Steps {
    fn cargo(&mut self, name: &str, arguments: &[&str], variables: &[(&str, &str)]) {
        self.run(name, || {
            let mut command = Command::new("cargo");
            command.args(arguments).envs(variables.iter().copied()).current_dir(workspace::root());
            run(&mut command).map(|()| Outcome::Passed)
        });
    }

    fn run(&mut self, name: &str, step: impl FnOnce() -> Result<Outcome>) {
        println!("\n=== {name}");
        let start = Instant::now();
        let result = step();
        let seconds = start.elapsed().as_secs();
        let line = match result {
            Ok(Outcome::Passed) => {
                self.passed += 1;
                format!("passed   {seconds:4} s  {name}")
            }
            Ok(Outcome::Skipped(reason)) => format!("skipped  {seconds:4} s  {name}: {reason}"),
            Err(error) => {
                self.failed += 1;
                eprintln!("error: {error:#}");
                let first = format!("{error:#}").lines().next().unwrap_or_default().to_owned();
                format!("FAILED   {seconds:4} s  {name}: {first}")
            }
        };
        self.lines.push(line);
    }

    fn finish(self) -> Result<()> {
        println!("\n{}", self.lines.join("\n"));
        println!("{} passed, {} failed", self.passed, self.failed);
        // The list above says what; a message of its own would no longer be its last line.
        if self.failed > 0 {
            std::process::exit(1);
        }
        Ok(())
    }
}

/// `cargo check` with the compiler that `rust-version` names.
fn oldest_compiler() -> Result<Outcome> {
    let version = env!("CARGO_PKG_RUST_VERSION");
    let installed =
        quiet(Command::new("rustup").args(["toolchain", "list"]), Duration::from_secs(20));
    let toolchain = installed.unwrap_or_default();
    let name = toolchain.lines().find_map(|line| {
        let name = line.split_whitespace().next()?;
        let matches = name == version
            || name.strip_prefix(version).is_some_and(|rest| rest.starts_with(['.', '-']));
        matches.then_some(name)
    });
    let Some(name) = name else {
        return Ok(Outcome::Skipped(format!(
            "Rust {version} is not installed (rustup toolchain install {version})"
        )));
    };
    let mut command = Command::new("rustup");
    command.args(["run", name, "cargo", "check", "--quiet", "--workspace", "--target-dir"]);
    command.arg(workspace::target().join("oldest"));
    command.env_remove("CARGO").env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
    run(command.current_dir(workspace::root())).map(|()| Outcome::Passed)
}

/// The core crate compiles for the board, with and without defmt: `core` is all that it has there.
fn core_crate(cross: &Cross) -> Result<Outcome> {
    for features in [&[][..], &["--features", "defmt"]] {
        let mut command = cross.cargo("check");
        run(command.args(["--quiet", "--package", "dibs-nostd"]).args(features))?;
    }
    Ok(Outcome::Passed)
}

fn firmware_lints(cross: &Cross) -> Result<Outcome> {
    if !matches!(cross, Cross::Rustup) {
        return Ok(Outcome::Skipped("Debian's compiler comes without clippy".to_owned()));
    }
    let mut command = cross.cargo("clippy");
    command.args(["--quiet", "--package", "firmware-example", "--bin", "board"]);
    command.args(["--features", "board", "--profile", "firmware", "--", "-D", "warnings"]);
    run(&mut command).map(|()| Outcome::Passed)
}

/// The firmware links, which it does only without panic paths; it has no allocator; and a panic
/// path put in on purpose breaks the link, so that the first check is known to check.
fn firmware_build(cross: &Cross) -> Result<Outcome> {
    let surface = Surface::default();
    let footprint = Footprint::read(&firmware::build(cross, &surface)?)?;
    let allocators = footprint.allocators.join(", ");
    ensure!(allocators.is_empty(), "the firmware has an allocator: {allocators}");

    let mut planted = firmware::command(cross, &surface);
    let build = planted.args(["--features", "planted-panic"]).output()?;
    let said = String::from_utf8_lossy(&build.stderr);
    ensure!(!build.status.success(), "a planted panic path did not break the link");
    ensure!(said.contains("a_panic_path_survived"), "it broke something else:\n{said}");
    Ok(Outcome::Passed)
}

fn demo_on_board(seconds: u32) -> Result<Outcome> {
    demo::run(&demo::Options { seconds, board_only: true, ..demo::Options::default() })
        .map(|()| Outcome::Passed)
}

fn demo_on_host(seconds: u32) -> Result<Outcome> {
    demo::run(&demo::Options { seconds, host: true, ..demo::Options::default() })
        .map(|()| Outcome::Passed)
}

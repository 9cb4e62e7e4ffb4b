//! `cargo xtask mutants`: changes operators of the core by `cargo-mutants`, and lists the changes that no test notices.
//!
//! `.cargo/mutants.toml` lists accepted survivors with their reasons, including mutants that were tried by hand.

use std::fs;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use xtask::process::{quiet, run};
use xtask::steps::Outcome;
use xtask::workspace;

/// The version of cargo-mutants that the lists of survivors are for.
const VERSION: &str = "27.1.0";

/// Folders of the core, each with the test programs and tests that try its mutants. There are few tests, so that a
/// trial takes only seconds in addition to its build.
const AREAS: [(&str, &[&str], &[&str]); 7] = [
    ("dibs-nostd/src/tool", &["query"], &["kernels", "refusals"]),
    (
        "dibs-nostd/src/query",
        &["query"],
        &["refusals", "slack", "batched", "positions", "tracker", "differential", "chain"],
    ),
    ("dibs-nostd/src/tree", &["tree", "query"], &["format", "refusals"]),
    ("dibs-nostd/src/stretch", &["surface"], &["stretch", "plausible"]),
    ("dibs-nostd/src/modes", &["surface"], &["modes_bound", "modes"]),
    ("dibs-nostd/src/wire", &["bus"], &["specification", "line", "authenticity"]),
    (
        "dibs-nostd/src/receive",
        &["bus"],
        &["complete", "order", "partial", "causes", "attacks", "authenticity"],
    ),
];

/// A part of the path of every unit test of the core.
const UNIT_TESTS: &str = "tests::";

/// The exit code of cargo-mutants if mutants survived.
const SURVIVED: i32 = 2;

/// Its exit code if mutants made the tests hang, and none survived.
const TIMED_OUT: i32 = 3;

/// Its exit code if the tests fail without a mutant.
const BASELINE_FAILED: i32 = 4;

/// Most mutants of changed lines that CI tries: each needs a build of the core and its tests.
const SAMPLE: usize = 4;

/// Changes operators of the core one by one, and lists the changes that no test notices. The whole core takes
/// hours; one mutant about a minute.
#[derive(clap::Args)]
pub struct Options {
    /// Only this file, or the files below this folder.
    #[arg(long, default_value = "dibs-nostd/src")]
    below: String,
    /// Only every mutant of this part, such as `1/20`: the second twentieth.
    #[arg(long, default_value = "0/1")]
    shard: String,
    /// Instead, a few mutants of the lines that changed since `main`, or in the last commit.
    #[arg(long, conflicts_with_all = ["below", "shard"])]
    changed: bool,
}

/// Tries the requested mutants.
pub fn mutants(options: &Options) -> Result<()> {
    if !options.changed {
        return whole(options);
    }
    match sample()? {
        Outcome::Skipped(reason) => bail!("no mutant was tried: {reason}"),
        _ => Ok(()),
    }
}

/// Tries every mutant of the requested folders.
fn whole(options: &Options) -> Result<()> {
    install()?;
    let mut areas = 0;
    for (folder, programs, tests) in AREAS {
        if folder.starts_with(&options.below) || options.below.starts_with(folder) {
            let below = if folder.len() > options.below.len() { folder } else { &options.below };
            let is_file = workspace::root().join(below).is_file();
            let filter = if is_file { below.to_owned() } else { format!("{below}/**") };
            run(&mut command(&["--file", &filter, "--shard", &options.shard], programs, tests))
                .with_context(|| format!("mutants of {below} survive: see target/mutants.out"))?;
            areas += 1;
        }
    }
    let folders = AREAS.map(|(folder, ..)| folder).join(", ");
    ensure!(areas > 0, "no tests are known for {}: only for {folders}", options.below);
    Ok(())
}

/// Tries a few mutants of the lines that changed since `main`, or in the last commit.
pub fn sample() -> Result<Outcome> {
    if let Err(error) = install() {
        return Ok(Outcome::Skipped(format!("no cargo-mutants: {error:#}")));
    }
    let Some(changes) = changes() else {
        return Ok(Outcome::Skipped("no earlier commit to compare with".to_owned()));
    };
    let diff = workspace::root().join("target/mutants.diff");
    fs::write(&diff, changes).with_context(|| format!("cannot write {}", diff.display()))?;
    let diff = diff.display().to_string();
    let mut tried = 0;
    for (folder, programs, tests) in AREAS {
        let filter = format!("{folder}/**");
        let changed = ["--file", &filter, "--in-diff", &diff];
        let mut list = command(&[&changed[..], &["--list"]].concat(), &[], &[]);
        let count = quiet(&mut list, Duration::from_secs(120))?.lines().count();
        if count > 0 && tried < SAMPLE {
            let shard = format!("0/{}", count.div_ceil(SAMPLE - tried));
            let mut trial =
                command(&[&changed[..], &["--shard", &shard]].concat(), programs, tests);
            let status = trial.status().context("cannot start cargo-mutants")?;
            match status.code() {
                // A test that hangs because of a mutant has noticed it.
                Some(0 | TIMED_OUT) => (),
                Some(SURVIVED) => {
                    bail!("no test notices a mutant of a changed line: see target/mutants.out")
                }
                Some(BASELINE_FAILED) => bail!("the tests fail without a mutant"),
                _ => return Ok(Outcome::Skipped(format!("cargo-mutants could not run: {status}"))),
            }
            tried += count.min(SAMPLE - tried);
        }
    }
    if tried == 0 {
        return Ok(Outcome::Skipped("no line changed that has a mutant".to_owned()));
    }
    println!("{tried} mutants of changed lines, all noticed");
    Ok(Outcome::Passed)
}

/// `cargo mutants` on the core, with these tests of these programs and the core's own.
fn command(arguments: &[&str], programs: &[&str], tests: &[&str]) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.current_dir(workspace::root());
    // The mutants have their own target folder. In the workspace's folder, the next build would use a mutant as the
    // core, because the core's sources are older.
    cargo.env("CARGO_TARGET_DIR", workspace::root().join("target/mutants"));
    cargo.args(["mutants", "--package", "dibs-nostd", "--output", "target"]).args(arguments);
    cargo.args(["--", "--package", "dibs-tests", "--package", "dibs-nostd", "--lib"]);
    for program in programs {
        cargo.args(["--test", program]);
    }
    cargo.args(["--", UNIT_TESTS]).args(tests.iter().map(|test| format!("{test}::")));
    cargo
}

/// The core's diff since the branch left `main`, or in the last commit; `None` without an earlier commit.
fn changes() -> Option<String> {
    let git = |arguments: &[&str]| {
        let mut git = Command::new("git");
        quiet(git.args(arguments).current_dir(workspace::root()), Duration::from_secs(20)).ok()
    };
    let base = git(&["merge-base", "main", "HEAD"]).unwrap_or_default();
    let is_ahead = git(&["rev-parse", "HEAD"]).is_some_and(|head| head.trim() != base.trim());
    let base = if is_ahead && !base.trim().is_empty() { base.trim() } else { "HEAD~1" };
    git(&["diff", base, "HEAD", "--", "dibs-nostd/src"])
}

fn install() -> Result<()> {
    let mut version = Command::new("cargo");
    if quiet(version.args(["mutants", "--version"]), Duration::from_secs(20)).is_ok() {
        return Ok(());
    }
    let mut cargo = Command::new("cargo");
    cargo.args(["install", "--quiet", "--locked", "cargo-mutants", "--version", VERSION]);
    quiet(&mut cargo, Duration::from_secs(600)).map(drop)
}

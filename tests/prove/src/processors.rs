//! The rows of docs/processors.md, each checked by the compiler on the core crate.

use std::fs;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use xtask::process::quiet;
use xtask::steps::Outcome;
use xtask::toolchain::add_target;
use xtask::workspace;

/// Fewer rows than this were not read from the page.
const LEAST: usize = 10;

/// The error of a core crate that has no compare-and-swap.
const NO_SWAP: &str = "no method named `compare_exchange`";

/// Longest time of a check.
const LIMIT: Duration = Duration::from_mins(10);

/// Checks all rows. Where rustup does not have a target, nothing is said of its row.
pub fn check() -> Result<Outcome> {
    let page = workspace::root().join("docs/processors.md");
    let page = fs::read_to_string(&page).context("docs/processors.md")?;
    let mut skipped = Vec::new();
    let rows = rows(&page)?;
    ensure!(rows.len() >= LEAST, "docs/processors.md has only {} of the rows to check", rows.len());
    for (target, works) in rows {
        match add_target(target) {
            Ok(()) => row(target, works)?,
            Err(error) => skipped.push(format!("{target} ({error:#})")),
        }
    }
    if skipped.is_empty() {
        return Ok(Outcome::Passed);
    }
    Ok(Outcome::Skipped(format!("not to be had: {}", skipped.join(", "))))
}

/// The targets, and whether they work.
fn rows(page: &str) -> Result<Vec<(&str, bool)>> {
    let rows = page.lines().filter_map(|line| {
        let mut cells = line.split('|').map(str::trim).skip(2);
        let target = cells.next()?.strip_prefix('`')?.strip_suffix('`')?;
        Some((target, cells.next()?))
    });
    rows.map(|(target, works)| match works {
        "yes" => Ok((target, true)),
        "no" => Ok((target, false)),
        other => bail!("docs/processors.md says `{other}` of {target}: yes or no"),
    })
    .collect()
}

/// Compiles where the row says that it works, and fails for want of compare-and-swap where it does not.
fn row(target: &str, works: bool) -> Result<()> {
    let mut cargo = Command::new("cargo");
    cargo.args([
        "check",
        "--release",
        "--message-format=short",
        "--package",
        "dibs-nostd",
        "--target",
        target,
    ]);
    cargo.arg("--target-dir").arg(workspace::target().join("processors"));
    cargo.current_dir(workspace::root());
    if works {
        let built = quiet(&mut cargo, LIMIT);
        return built.map(drop).with_context(|| format!("docs/processors.md says {target} works"));
    }
    let output = cargo.output()?;
    ensure!(!output.status.success(), "docs/processors.md says {target} does not work: it does");
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(said.contains(NO_SWAP), "{target} fails for another reason:\n{said}");
    Ok(())
}

//! The rows of docs/processors.md, each checked by compiling the core crate.

use std::fs;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use xtask::process::quiet;
use xtask::steps::Outcome;
use xtask::toolchain::add_target;
use xtask::workspace;

/// If fewer rows than this are found, the page was not parsed correctly.
const LEAST: usize = 10;

/// The feature that a core crate without compare-and-swap needs, as a row names it.
const PORTABLE: &str = "portable-atomic";

/// The compiler's error for a core crate without compare-and-swap.
const NO_SWAP: &str = "no method named `compare_exchange`";

/// Longest time of a check.
const LIMIT: Duration = Duration::from_mins(10);

/// Checks all rows. A row whose target rustup does not have is skipped.
pub fn check() -> Result<Outcome> {
    let page = workspace::root().join("docs/processors.md");
    let page = fs::read_to_string(&page).context("docs/processors.md")?;
    let mut skipped = Vec::new();
    let rows = rows(&page)?;
    ensure!(rows.len() >= LEAST, "docs/processors.md has only {} of the rows to check", rows.len());
    for (target, works) in rows {
        match add_target(target) {
            Ok(()) if works => compiles(target, None)?,
            Ok(()) => {
                lacks_swap(target)?;
                compiles(target, Some(PORTABLE))?;
            }
            Err(error) => skipped.push(format!("{target} ({error:#})")),
        }
    }
    if skipped.is_empty() {
        return Ok(Outcome::Passed);
    }
    Ok(Outcome::Skipped(format!("not to be had: {}", skipped.join(", "))))
}

/// The targets, each with whether it works without the feature.
fn rows(page: &str) -> Result<Vec<(&str, bool)>> {
    let rows = page.lines().filter_map(|line| {
        let mut cells = line.split('|').map(str::trim).skip(2);
        let target = cells.next()?.strip_prefix('`')?.strip_suffix('`')?;
        Some((target, cells.next()?))
    });
    rows.map(|(target, works)| match works {
        "yes" => Ok((target, true)),
        "by `portable-atomic`" => Ok((target, false)),
        other => bail!("docs/processors.md says `{other}` of {target}: yes or by `{PORTABLE}`"),
    })
    .collect()
}

fn check_of(target: &str) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.args(["check", "--release", "--message-format=short", "--package", "dibs-nostd"]);
    cargo.args(["--target", target, "--target-dir"]);
    cargo.arg(workspace::target().join("processors")).current_dir(workspace::root());
    cargo
}

fn compiles(target: &str, feature: Option<&str>) -> Result<()> {
    let mut cargo = check_of(target);
    cargo.args(feature.into_iter().flat_map(|feature| ["--features", feature]));
    let built = quiet(&mut cargo, LIMIT);
    built.map(drop).with_context(|| format!("docs/processors.md says {target} works"))
}

/// Checks that the build fails for lack of compare-and-swap, and for no other reason.
fn lacks_swap(target: &str) -> Result<()> {
    let output = check_of(target).output()?;
    ensure!(
        !output.status.success(),
        "docs/processors.md says {target} needs `{PORTABLE}`: it works without"
    );
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(said.contains(NO_SWAP), "{target} fails for another reason:\n{said}");
    Ok(())
}

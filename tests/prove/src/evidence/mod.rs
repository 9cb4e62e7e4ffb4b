//! `cargo xtask evidence`: everything below docs/evidence that programs measure or write, in one run of one commit.
//!
//! Each part runs in a process of its own and is kept with the commit and the machine that measured it, so that an
//! interrupted run continues. Pages are written only from all parts of one commit.

// Requirement: E-02

pub mod pages;
pub mod parts;
pub mod runner;

use std::fs;
use std::path::PathBuf;

use anyhow::{Result, ensure};
use xtask::toolchain::Cross;
use xtask::{c_firmware, qemu, workspace};

use crate::checks::other_processors::prepare;
use crate::harness::Effort;
use crate::harness::run::{Run, said};
use pages::{release, write};
use runner::measure;

/// Measures everything that docs/evidence shows, in one run that can be interrupted and continued at the same commit,
/// and writes the pages. `docs/evidence/run.md` says how long it took on two idle cores. `cargo xtask peers` and the walks are not of
/// it.
#[derive(clap::Args)]
pub struct Options {
    /// Where parts and pages are kept; `evidence` in Cargo's target folder if absent.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Also copies the pages to docs/evidence, and writes the figures of the README and of docs/ anew.
    #[arg(long)]
    release: bool,
    /// Only parts whose names contain this: measures them and writes no page.
    #[arg(long, conflicts_with = "release")]
    only: Option<String>,
    /// Lists the parts, the time that each took last, and which pages the run does not write.
    #[arg(long)]
    list: bool,
    /// As for `cargo xtask guarantees`.
    #[arg(long, value_delimiter = ',', requires = "because")]
    raise: Vec<String>,
    /// As for `cargo xtask guarantees`.
    #[arg(long, default_value = "")]
    because: String,
}

/// Runs the task.
pub fn run(options: &Options) -> Result<()> {
    let folder = options.out.clone().unwrap_or_else(|| workspace::target().join("evidence"));
    // The parts run in other folders.
    fs::create_dir_all(&folder)?;
    let folder = folder.canonicalize()?;
    let mut parts = parts::all()?;
    if let Some(only) = &options.only {
        parts.retain(|part| part.name.contains(only.as_str()));
    }
    if options.list {
        print!("{}", pages::list(&parts, &folder));
        return Ok(());
    }
    // Found first: both lanes would install them, and a run names the emulator, of which another may bring a new version.
    Cross::find()?;
    for prepared in [qemu::find().map(drop), prepare(), c_firmware::find().map(drop)] {
        if let Err(error) = prepared {
            println!("parts will fail without it: {error:#}");
        }
    }
    measure(&parts, &folder, &now)?;
    if options.only.is_some() {
        return Ok(());
    }
    let writers = parts::writers(&folder, &options.raise, &options.because)?;
    write(&parts, &writers, &folder, &now)?;
    if options.release {
        release(&folder)?;
    }
    Ok(())
}

/// The commit, and with `-dirty` also if only documents differ.
fn now() -> Run {
    let mut run = Run::now(Effort::RELEASE.size());
    if !said("git", &["status", "--porcelain"]).is_empty() && !run.commit.ends_with("-dirty") {
        run.commit += "-dirty";
    }
    run
}

/// An error unless the run is of a clean commit.
fn ensure_clean(run: &Run) -> Result<()> {
    ensure!(run.is_whole(), "commit or stash the changes first: evidence is of one commit");
    Ok(())
}

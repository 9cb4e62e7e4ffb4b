//! `cargo xtask coverage`: which statements and branches of the core its own tests and those of `tests/` execute.
//!
//! The nightly compiler counts, [`measure`]; what it counted is read by [`export`]; test code is left out by
//! [`own_tests`]. [`record`] has the result, and [`reasons`] why a place is not executed.

// Requirement: E-06

pub mod export;
pub mod measure;
pub mod own_tests;
pub mod page;
pub mod reasons;
pub mod record;

use std::fs;

use anyhow::{Context, Result, bail, ensure};
use xtask::{nightly, workspace};

use reasons::Reason;
use record::Record;

/// Counts which statements and branches of the core its tests execute, and writes docs/evidence/coverage.json and
/// docs/evidence/coverage.md. It compiles the tests for that, and takes about half an hour on two cores.
#[derive(clap::Args)]
pub struct Options {
    /// Makes the page anew from coverage.json and the reasons, and counts nothing.
    #[arg(long)]
    page: bool,
    /// Takes what the last run counted, and runs no test.
    #[arg(long, conflicts_with = "page")]
    counted: bool,
}

pub const RECORD: &str = "coverage.json";

/// Runs the task.
pub fn run(options: &Options) -> Result<()> {
    let file = workspace::evidence().join(RECORD);
    let record = if options.page {
        Record::read(&file)?
    } else {
        if let Some(reason) = nightly::missing() {
            bail!("{reason}");
        }
        if !options.counted {
            measure::count()?;
        }
        let (run, exports) = measure::exported()?;
        let record = Record::of(run, &exports)?;
        ensure!(!record.files.is_empty(), "no file of the core was counted");
        let text = serde_json::to_string_pretty(&record)? + "\n";
        fs::write(&file, text).with_context(|| format!("cannot write {}", file.display()))?;
        record
    };
    let page = workspace::evidence().join("coverage.md");
    let reasons = Reason::read()?;
    fs::write(&page, page::page(&record, &reasons))
        .with_context(|| format!("cannot write {}", page.display()))?;
    println!("{}\n{}", page::summary(&record, &reasons), page.display());
    Ok(())
}

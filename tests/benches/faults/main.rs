//! The fault matrix: what becomes of faults on the bus, and of frames on a bad one.
//!
//! `cargo bench -p dibs-tests --bench faults -- [--per-fault N] [--write docs/faults.json]`
//!
//! Ends with an error if anything was published that was never sent, if a fault was neither noticed nor
//! harmless, or if the receiver did not recover.

mod corruption;
mod matrix;
mod record;
mod sizes;
mod subject;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Parser;

/// What the fault matrix is asked.
#[derive(Parser)]
struct Arguments {
    /// Faults of each kind; 300 as a test.
    #[arg(long)]
    per_fault: Option<u64>,
    /// First of the seeds.
    #[arg(long, default_value_t = 20_140_350)]
    seed: u64,
    /// Where to write the record; the figure goes to the folder figures beside it.
    #[arg(long)]
    write: Option<PathBuf>,
    /// Set by `cargo bench`, not by `cargo test --benches`.
    #[arg(long)]
    bench: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let per_fault = arguments.per_fault.unwrap_or(if arguments.bench { 100_000 } else { 300 });
    let matrix = matrix::run(per_fault, arguments.seed)?;
    let matrix_seconds = start.elapsed().as_secs_f64();
    for row in &matrix {
        println!("{row}");
    }
    let is_full = arguments.bench || arguments.write.is_some();
    let (corruption, sizes) = if is_full {
        (corruption::run(arguments.seed)?, sizes::run()?)
    } else {
        (corruption::smoke(arguments.seed)?, Vec::new())
    };
    for row in &corruption {
        println!("{row}");
    }
    for row in &sizes {
        println!("{row}");
    }
    println!("{per_fault} faults of each kind in {matrix_seconds:.0} s");
    let record = record::Record {
        per_fault,
        seed: arguments.seed,
        undetectable: record::UNDETECTABLE,
        matrix,
        corruption,
        sizes,
    };
    if let Some(path) = &arguments.write {
        // From the folder that cargo was called in, not from the package's own.
        let path = if path.is_absolute() {
            path.clone()
        } else {
            Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
        };
        record.write(&path)?;
        println!("written to {}", path.display());
    }
    let broken = record.broken();
    if !broken.is_empty() {
        bail!("broken promises:\n  {}", broken.join("\n  "));
    }
    Ok(())
}

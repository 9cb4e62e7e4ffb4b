//! The fault matrix: what becomes of faults on the bus, and of frames on a bad one.
//!
//! `cargo bench -p dibs-tests --bench faults -- [--per-fault N] [--write docs/faults.json]`
//!
//! The same on the emulated board, through its UART: `cargo xtask guarantees --only "faults on the board"`,
//! which builds the program for `--board`.
//!
//! Ends with an error if anything was published that was never sent, if a fault was neither noticed nor
//! harmless, or if the receiver did not recover.

mod board;
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
use matrix::Place;

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
    /// The probe `bus` for the board: the receiver is there, and only the matrix is made.
    #[arg(long)]
    board: Option<PathBuf>,
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
    let place = arguments.board.as_deref().map_or(Place::Here, Place::Board);
    let matrix = matrix::run(per_fault, arguments.seed, place)?;
    let matrix_seconds = start.elapsed().as_secs_f64();
    for row in &matrix {
        println!("{row}");
    }
    let is_full = arguments.bench || arguments.write.is_some();
    let (corruption, sizes) = match place {
        Place::Board(_) => (Vec::new(), Vec::new()),
        Place::Here if is_full => (corruption::run(arguments.seed)?, sizes::run()?),
        Place::Here => (corruption::smoke(arguments.seed)?, Vec::new()),
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

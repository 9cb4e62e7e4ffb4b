//! The guarantees that this computer can check by itself, at full size. `cargo xtask guarantees` runs
//! this and puts its figures into docs/guarantees.json.

mod anytime;
mod corruption;
mod figures;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use figures::Figures;

/// Counts how often a promise was broken, among this many cases.
#[derive(Parser)]
struct Arguments {
    /// File for the figures; standard output if absent.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Cases of each check.
    #[arg(long)]
    cases: Option<usize>,
    /// Given by `cargo bench`; without it a hundredth of the cases is run.
    #[arg(long, hide = true)]
    bench: bool,
    /// Given by `cargo test`.
    #[arg(long, hide = true)]
    test: bool,
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
    let cases = arguments.cases.unwrap_or(if arguments.bench { 1_000_000 } else { 10_000 });
    let mut figures = Figures::default();
    anytime::check(cases, &mut figures);
    corruption::check(cases, &mut figures);
    figures.write(arguments.out.as_deref())?;
    figures.verdict()
}

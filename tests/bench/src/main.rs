//! `cargo xtask bench` runs this.

// Requirement: E-05

use std::process::ExitCode;

use clap::Parser;

/// `cargo xtask` passes its arguments on to this.
#[derive(Parser)]
#[command(name = "cargo xtask bench", bin_name = "cargo xtask bench")]
struct Arguments {
    #[command(flatten)]
    options: dibs_bench::Options,
}

fn main() -> ExitCode {
    match dibs_bench::bench(&Arguments::parse().options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

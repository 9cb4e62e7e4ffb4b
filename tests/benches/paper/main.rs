//! The paper's experiments: `cargo xtask bench`.

// `tests/benchmarks.rs` shares these modules.
#[path = "mod.rs"]
mod paper;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use clap::Parser;
use paper::plan::{Arguments, Plan};
use paper::record::Records;

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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let default: PathBuf =
        if arguments.quick { root.join("target/bench") } else { root.join("docs") };
    let folder = arguments.out.clone().unwrap_or(default);
    let records = if arguments.render {
        Records::read(&folder.join("benchmarks.json"))?
    } else if arguments.paper_search {
        let mut records = Records::read(&folder.join("benchmarks.json"))?;
        paper::search::run(&Plan::of(arguments), &mut records)?;
        records
    } else if !arguments.bench && arguments.out.is_none() {
        // `cargo test --benches` asks a benchmark whether it works.
        paper::run(&Plan::smoke(), arguments)?;
        return Ok(());
    } else {
        let start = Instant::now();
        let records = paper::run(&Plan::of(arguments), arguments)?;
        println!("measured in {:.0} s", start.elapsed().as_secs_f64());
        records
    };
    paper::write(&records, &folder)?;
    println!("written to {}", folder.display());
    Ok(())
}

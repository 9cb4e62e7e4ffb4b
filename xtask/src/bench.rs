//! `cargo xtask bench`: the paper's experiments, beside the best of today's alternatives.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::process::run as run_command;
use crate::{demo, workspace};

/// Runs the paper's experiments: DIBS, the paper's baselines and today's peers, on the same surfaces and
/// tools. Writes docs/benchmarks.json and everything that is made from it.
#[derive(clap::Args)]
pub struct Options {
    /// A few minutes instead of half an hour: fewer queries. Writes to target/bench, not to docs.
    #[arg(long)]
    quick: bool,
    /// At most this many queries of each brain and tool, instead of the paper's 10,000.
    #[arg(long)]
    queries: Option<usize>,
    /// Where to write instead.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Measures nothing: makes the documents and figures anew from benchmarks.json.
    #[arg(long)]
    render: bool,
    /// Leaves out the emulated Cortex-M7.
    #[arg(long)]
    no_board: bool,
}

/// Runs the benchmark.
pub fn run(options: &Options) -> Result<()> {
    let mut cargo = Command::new("cargo");
    cargo.args(["bench", "--package", "dibs-tests", "--bench", "paper", "--"]);
    cargo.current_dir(workspace::root());
    if options.quick {
        cargo.arg("--quick");
    }
    if let Some(queries) = options.queries {
        cargo.arg("--queries").arg(queries.to_string());
    }
    if let Some(out) = &options.out {
        cargo.arg("--out").arg(std::path::absolute(out)?);
    }
    if options.render {
        cargo.arg("--render");
    } else if !options.no_board {
        match board(options.quick) {
            Ok(report) => {
                cargo.arg("--m7").arg(report);
            }
            Err(error) => eprintln!("the Cortex-M7's part is left out: {error:#}"),
        }
    }
    run_command(&mut cargo).context("the benchmark failed")
}

/// Table 3 on the emulated board: the demo's path and heart. Returns the demo's report.
fn board(quick: bool) -> Result<PathBuf> {
    let seconds = if quick { 7 } else { 14 };
    demo::run(&demo::Options { seconds, ..demo::Options::default() })?;
    Ok(workspace::demo().join("report.json"))
}

#[cfg(test)]
mod tests {
    use dibs_nostd::Tool;
    use dibs_tests::method::Probe;
    use dibs_tests::streams::Beat;

    /// So that the board's row of table 3 is of the same path as the others.
    #[test]
    fn the_tool_about_the_heart_moves_as_the_firmware_s() {
        let (_, motion) = dibs_build::generate::heart(10_272).expect("a valid size");
        let beat = Beat::new(&motion);
        for tick in (0..77_000).step_by(137) {
            let Probe::Capsule(ours) = beat.tool(tick) else { panic!("a capsule") };
            let theirs = controller::instrument(tick).expect("a valid tool");
            let off = ours.start().distance(theirs.start()).max(ours.end().distance(theirs.end()));
            assert!(off < 1e-3 && ours.radius() == theirs.radius(), "{tick}: {ours:?} {theirs:?}");
        }
    }
}

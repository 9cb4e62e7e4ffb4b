//! Reading a mesh file on the command line.

use anyhow::Result;
use dibs_build::{Import, ReadOptions};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;

/// How a mesh file is read.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// Fail on degenerate and duplicate triangles, instead of dropping them
    #[arg(long)]
    strict: bool,
    /// Weld vertices at most this far apart (0: equal ones); by default only soup is welded, exactly
    #[arg(long, value_name = "TOLERANCE")]
    weld: Option<f32>,
    /// Keep the largest of several separate surfaces
    #[arg(long)]
    largest_component: bool,
}

/// Reads a mesh, and prints its warnings on standard error.
pub fn read(path: &Path, args: &MeshArgs) -> Result<Import> {
    let options = ReadOptions {
        weld_tolerance: args.weld,
        strict: args.strict,
        largest_component: args.largest_component,
    };
    let import = options.read(path)?;
    for warning in import.report.warnings() {
        eprintln!("warning: {}: {warning}", path.display());
    }
    Ok(import)
}

/// A bar for work on so many triangles.
pub fn progress_bar(doing: &str, triangles: usize) -> ProgressBar {
    let bar = ProgressBar::new(triangles as u64);
    let template = format!("{doing} {{bar:40}} {{percent}}% {{elapsed}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}

//! `dibs inspect`: the size, cost and properties of a tree file, and whether it is intact.

use crate::overwrite;
use crate::tree_file::{self, AnyTree};
use anyhow::Result;
use dibs_build::summarise;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs inspect heart.dibs
  dibs inspect heart.dibs --json")]
pub struct Args {
    /// A tree file that `dibs build` wrote
    tree: PathBuf,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    overwrite::check([&args.tree], [])?;
    let bytes = tree_file::load(&args.tree)?;
    let summary = match tree_file::validate(&bytes, &args.tree)? {
        AnyTree::Narrow(tree) => summarise(&tree, bytes.len()),
        AnyTree::Wide(tree) => summarise(&tree, bytes.len()),
    };
    if args.json {
        println!("{:#}", serde_json::to_value(summary)?);
    } else {
        tree_file::print(&summary);
    }
    Ok(())
}

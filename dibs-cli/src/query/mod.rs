//! `dibs query`: the closest pair between an instrument and one or several surfaces, and all contacts.

mod answer;
mod bulk;
mod scene;

pub use answer::{Answer, ContactRecord, Record, Touch, side_name, vector};
pub use scene::{ALLOW, Room, STACK, Surface, ask, rows};

use crate::mesh_file::Lengths;
use crate::tool::{self, ToolSpec};
use crate::{overwrite, tree_file};
use anyhow::{Result, bail};
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs query heart.dibs --tool sphere:0,0,150,5
  dibs query heart.dibs --tool capsule:0,0,60,0,0,200,4 --vertices heart.pc2 --frame 9 --json
  dibs query heart.dibs --tool sphere:0,0,90,5 --contacts 8
  dibs query heart.dibs lung.dibs --tool capsule:0,0,60,0,0,90,4 --tool capsule:0,0,90,9,0,120,3
  dibs query heart.dibs --poses poses.csv -o answers.jsonl
  produce | dibs query heart.dibs --poses - | consume

A tool is one of these, in --tool as in a line of --poses, or of --path of other commands:
  0,0,150,5           sphere:0,0,150,5               {\"sphere\": [0, 0, 150, 5]}
  0,0,60,0,0,200,4    capsule:0,0,60,0,0,200,4       {\"capsule\": [0, 0, 60, 0, 0, 200, 4]}
that is X,Y,Z,R or X1,Y1,Z1,X2,Y2,Z2,R. A line of --poses may be a chain, too, and gives one JSON object on a line:
  sphere:0,0,150,5 capsule:0,0,150,0,0,200,4
  [{\"sphere\": [0, 0, 150, 5]}, {\"capsule\": [0, 0, 150, 0, 0, 200, 4]}]
A first line of column names is skipped, and so are empty lines.")]
pub struct Args {
    /// Tree files that `dibs build` wrote, at most 16: a scene
    #[arg(required = true, value_name = "TREE", num_args = 1..=16)]
    trees: Vec<PathBuf>,
    /// A tool: X,Y,Z,R, a sphere, or X1,Y1,Z1,X2,Y2,Z2,R, a capsule; up to eight of them are a chain
    #[arg(long, value_parser = tool::one, allow_hyphen_values = true, required_unless_present = "poses")]
    tool: Vec<ToolSpec>,
    /// Answer every line of this file (CSV or JSON lines) with a JSON line; `-` is standard input
    #[arg(long, value_name = "POSES", conflicts_with = "tool")]
    poses: Option<PathBuf>,
    /// The file for the answers to --poses, written completely or not at all; `-` is standard output
    #[arg(short, long, default_value = "-", requires = "poses")]
    output: PathBuf,
    /// Also list all locally closest pairs with a separation of at most this: up to 64 of each tool and surface
    #[arg(long, value_name = "MM")]
    contacts: Option<f32>,
    /// Current positions, one for each vertex of the built mesh: a mesh file, or a motion with
    /// --frame; by default the rest shape. In a scene, once for each tree, in their order
    #[arg(long)]
    vertices: Vec<PathBuf>,
    /// Frame of a motion, counted from 0
    #[arg(long, requires = "vertices")]
    frame: Option<usize>,
    /// Fail if the surface is stretched by more than this, and search with its measured stretch instead of the tree's
    /// limit
    #[arg(long)]
    stretch: Option<f32>,
    #[command(flatten)]
    lengths: Lengths,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    tool::check_chain(&args.tool)?;
    let (trees, vertices) = (args.trees.len(), args.vertices.len());
    if vertices != 0 && vertices != trees {
        bail!(
            "--vertices is given {vertices} times for {trees} trees: give it once for each, or never"
        );
    }
    let inputs = args.trees.iter().chain(&args.vertices).chain(&args.poses);
    overwrite::check(inputs, [&args.output])?;
    let files = args.trees.iter().map(|path| tree_file::load(path));
    let files = files.collect::<Result<Vec<_>>>()?;
    let surfaces: Vec<Surface> = args
        .trees
        .iter()
        .zip(&files)
        .enumerate()
        .map(|(number, (path, bytes))| {
            let vertices = args.vertices.get(number);
            Surface::new(bytes, path, vertices, args.frame, &args.lengths, args.stretch)
        })
        .collect::<Result<_>>()?;
    if let Some(poses) = &args.poses {
        return bulk::run(&surfaces, args.contacts, poses, &args.output);
    }
    let answer = ask(&surfaces, &args.tool, args.contacts, &mut Room::default())?;
    if let Some(margin) = args.contacts
        && answer.bound < margin
    {
        eprintln!("warning: only contacts with a separation below {} are all listed", answer.bound);
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&answer.record(None))?);
    } else {
        answer.print(trees, args.tool.len());
    }
    Ok(())
}

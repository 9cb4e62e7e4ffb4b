//! `dibs generate`: procedural surfaces.

use crate::mesh_file::spinner;
use crate::overwrite;
use anyhow::Result;
use clap::Subcommand;
use dibs_build::{Format, generate};
use serde_json::json;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs generate heart --triangles 10272 -o heart.ply --motion heart.pc2
  dibs generate brain --triangles 50000 -o brain.ply")]
pub struct Args {
    #[command(subcommand)]
    surface: Surface,
    /// Print a JSON object
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Surface {
    /// A beating heart, in mm: closed, manifold, one component
    Heart {
        /// Triangles: an even number
        #[arg(long, default_value_t = 10_272)]
        triangles: u32,
        /// The mesh to write: .ply, .stl, .obj or .off
        #[arg(short, long)]
        output: PathBuf,
        /// The motion to write, PC2: one cycle
        #[arg(long)]
        motion: Option<PathBuf>,
    },
    /// A cortex with gyri and sulci, in mm: closed, manifold, one component
    Brain {
        /// Triangles: an even number
        #[arg(long, default_value_t = 50_000)]
        triangles: u32,
        /// The mesh to write: .ply, .stl, .obj or .off
        #[arg(short, long)]
        output: PathBuf,
    },
}

pub fn run(args: &Args) -> Result<()> {
    let (Surface::Heart { output, .. } | Surface::Brain { output, .. }) = &args.surface;
    // Checked before the work starts.
    let format = Format::from_name(output)?;
    let motion = match &args.surface {
        Surface::Heart { motion, .. } => motion.as_ref(),
        Surface::Brain { .. } => None,
    };
    overwrite::check([], [output].into_iter().chain(motion))?;
    let mut moved = None;
    let mesh = match &args.surface {
        Surface::Heart { triangles, motion, .. } => {
            let generate::MovingMesh { mesh, motion: beat } = generate::heart(*triangles)?;
            if let Some(path) = motion {
                beat.write_pc2(path)?;
                moved = Some((path, beat.frames.len()));
            }
            mesh
        }
        Surface::Brain { triangles, .. } => {
            let spinner = spinner("folding a cortex");
            let made = generate::brain(*triangles);
            spinner.finish_and_clear();
            made?
        }
    };
    mesh.write(output, format)?;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    if args.json {
        let motion = moved.map(|(path, frames)| json!({ "output": path, "frames": frames }));
        let written = json!({
            "output": output, "vertices": vertices, "triangles": triangles, "motion": motion,
        });
        println!("{written:#}");
        return Ok(());
    }
    if let Some((path, frames)) = moved {
        println!("written  {}: {frames} frames", path.display());
    }
    println!("written  {}: {vertices} vertices, {triangles} triangles", output.display());
    Ok(())
}

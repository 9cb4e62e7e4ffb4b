//! `dibs query`: the closest pair between a tool and a surface.

use crate::tree_file::{self, AnyTree};
use anyhow::{Result, anyhow, bail};
use dibs_build::{Import, Motion, ReadOptions};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, Index, MeasuredStretch, Options, Proximity, Query, Sphere, StretchError, Tool, Tree,
    measure_stretch,
};
use std::path::{Path, PathBuf};

/// As much as any tree needs.
pub const STACK: usize = dibs_nostd::format::MAX_STACK;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs query heart.dibs --tool sphere:0,0,150,5
  dibs query heart.dibs --tool capsule:0,0,60,0,0,200,4 --vertices heart.pc2 --frame 9 --json")]
pub struct Args {
    /// A tree file that `dibs build` wrote
    tree: PathBuf,
    /// sphere:X,Y,Z,R or capsule:X1,Y1,Z1,X2,Y2,Z2,R
    #[arg(long, value_parser = parse_tool, allow_hyphen_values = true)]
    tool: ToolSpec,
    /// Current positions, one for each vertex of the built mesh: a mesh file, or a .pc2 file with
    /// --frame; by default the rest shape
    #[arg(long)]
    vertices: Option<PathBuf>,
    /// Frame of a .pc2 file, counted from 0
    #[arg(long, requires = "vertices")]
    frame: Option<usize>,
    /// Fail if the surface is stretched by more than this, and search with the stretch that it has
    /// instead of the tree's limit
    #[arg(long)]
    stretch: Option<f32>,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy)]
pub enum ToolSpec {
    Sphere(Sphere),
    Capsule(Capsule),
}

pub fn parse_tool(text: &str) -> Result<ToolSpec> {
    let (shape, numbers) = text.split_once(':').ok_or_else(|| anyhow!("no ':' after the shape"))?;
    let numbers: Vec<f32> = numbers
        .split(',')
        .map(|n| n.trim().parse().map_err(|_| anyhow!("'{n}' is not a number")))
        .collect::<Result<_>>()?;
    match (shape, numbers.as_slice()) {
        ("sphere", &[x, y, z, radius]) => {
            Ok(ToolSpec::Sphere(Sphere::new(Vec3::new(x, y, z), radius)?))
        }
        ("capsule", &[x1, y1, z1, x2, y2, z2, radius]) => {
            let (start, end) = (Vec3::new(x1, y1, z1), Vec3::new(x2, y2, z2));
            Ok(ToolSpec::Capsule(Capsule::new(start, end, radius)?))
        }
        _ => bail!("expected sphere:X,Y,Z,R or capsule:X1,Y1,Z1,X2,Y2,Z2,R"),
    }
}

pub fn run(args: &Args) -> Result<()> {
    let bytes = tree_file::load(&args.tree)?;
    let answer = match tree_file::validate(&bytes, &args.tree)? {
        AnyTree::Narrow(tree) => ask(args, &tree)?,
        AnyTree::Wide(tree) => ask(args, &tree)?,
    };
    answer.print(args.json);
    Ok(())
}

struct Answer {
    proximity: Proximity,
    /// Corners of the triangle, numbered as in the mesh file.
    triangle: [u32; 3],
    /// `None` where the tree has no rest metric to measure with.
    stretch: Option<MeasuredStretch>,
}

fn ask<I: Index>(args: &Args, tree: &Tree<'_, I>) -> Result<Answer> {
    let name = args.tree.display();
    let positions = match &args.vertices {
        None => (0..tree.vertex_count())
            .map(|row| tree.rest_position(row))
            .collect::<Option<Vec<Vec3>>>()
            .ok_or_else(|| anyhow!("{name}: the tree has no rest shape, give --vertices"))?,
        Some(path) => rows(tree, path, &current(path, args.frame)?)?,
    };
    // A distance on a surface that is stretched beyond the limit could be wrong: none is given.
    let stretch = match measure_stretch(tree, positions.as_slice()) {
        Ok(measured) => Some(measured),
        Err(StretchError::NoMetric) => None,
        Err(error) => bail!(
            "{name}: {error}; build the tree with a larger --stretch, or with --limits that allow it"
        ),
    };
    let mut options = Options::new();
    if let Some(limit) = args.stretch {
        let measured =
            stretch.ok_or_else(|| anyhow!("{name}: no rest metric to measure a stretch with"))?;
        let sigma = measured.sigma();
        if sigma > limit || limit.is_nan() {
            bail!(
                "{name}: the surface is stretched by {sigma}, more than the {limit} of --stretch"
            );
        }
        options = options.stretch(measured);
    }
    let proximity = match args.tool {
        ToolSpec::Sphere(sphere) => closest(tree, &positions, &sphere, &options),
        ToolSpec::Capsule(capsule) => closest(tree, &positions, &capsule, &options),
    }
    .map_err(|error| anyhow!("{name}: {error}"))?;
    let number = |row| tree.vertex_number(row).unwrap_or(row);
    Ok(Answer { proximity, triangle: proximity.corners.map(number), stretch })
}

fn closest<I: Index>(
    tree: &Tree<'_, I>,
    positions: &[Vec3],
    tool: &impl Tool,
    options: &Options,
) -> Result<Proximity> {
    Ok(Query::<I, STACK>::new(tree)?.closest(positions, tool, options)?)
}

/// Positions in the order of the mesh file.
fn current(path: &Path, frame: Option<usize>) -> Result<Vec<Vec3>> {
    let name = path.display();
    let is_motion = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pc2"));
    match (is_motion, frame) {
        (true, None) => bail!("{name}: choose a frame of the motion with --frame"),
        (true, Some(frame)) => {
            let mut frames = Motion::read_pc2(path)?.frames;
            if frame >= frames.len() {
                bail!("{name}: no frame {frame}, the motion has {}", frames.len());
            }
            Ok(frames.swap_remove(frame))
        }
        (false, Some(_)) => bail!("{name}: --frame needs a .pc2 file"),
        // What is connected is the tree's matter here.
        (false, None) => {
            let options = ReadOptions { largest_component: true, ..Import::options() };
            Ok(options.read(path)?.mesh.positions)
        }
    }
}

/// Puts positions into the order of the tree's rows.
pub fn rows<I: Index>(tree: &Tree<'_, I>, path: &Path, of_mesh: &[Vec3]) -> Result<Vec<Vec3>> {
    (0..tree.vertex_count())
        .map(|row| {
            let vertex = tree.vertex_number(row).unwrap_or(row);
            of_mesh.get(vertex as usize).copied().ok_or_else(|| {
                anyhow!(
                    "{}: has {} vertices and the tree uses vertex {vertex}; give the positions of \
                     the mesh that the tree was built from",
                    path.display(),
                    of_mesh.len()
                )
            })
        })
        .collect()
}

impl Answer {
    fn print(&self, json: bool) {
        let p = &self.proximity;
        if json {
            println!(
                "{:#}",
                serde_json::json!({
                    "separation": p.separation,
                    "lower": p.lower,
                    "accuracy": p.accuracy,
                    "axis_distance": p.axis_distance,
                    "point_on_surface": p.point_on_surface.to_array(),
                    "point_on_tool": p.point_on_tool.to_array(),
                    "direction": p.direction.to_array(),
                    "axis_parameter": p.axis_parameter,
                    "triangle": self.triangle,
                    "barycentric": p.barycentric,
                    "stretch": self.stretch.map(|measured| measured.sigma()),
                    "node_tests": p.node_tests,
                    "triangle_tests": p.triangle_tests,
                })
            );
            return;
        }
        println!("separation        {} (within {:.1e})", p.separation, p.accuracy);
        println!("point on surface  {}", p.point_on_surface);
        println!("point on tool     {}", p.point_on_tool);
        println!("triangle          {:?}, weights {:?}", self.triangle, p.barycentric);
        if let Some(measured) = self.stretch {
            println!("stretch           {}", measured.sigma());
        }
        println!("tests             {} nodes, {} triangles", p.node_tests, p.triangle_tests);
    }
}

//! `dibs query`: the closest pair between an instrument and one surface or several, and all contacts.

use crate::tree_file::{self, AnyTree};
use anyhow::{Result, anyhow, bail};
use dibs_build::{Import, Motion, ReadOptions};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, Contact, Contacts, Index, MeasuredStretch, Options, Proximity, Query, Side, Sphere,
    StretchError, Tool, Tree, measure_stretch,
};
use std::path::{Path, PathBuf};

/// As much as any tree needs.
pub const STACK: usize = dibs_nostd::format::MAX_STACK;

/// Most tools of a chain.
const MOST_TOOLS: usize = 8;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs query heart.dibs --tool sphere:0,0,150,5
  dibs query heart.dibs --tool capsule:0,0,60,0,0,200,4 --vertices heart.pc2 --frame 9 --json
  dibs query heart.dibs --tool sphere:0,0,90,5 --contacts 8
  dibs query heart.dibs lung.dibs --tool capsule:0,0,60,0,0,90,4 --tool capsule:0,0,90,9,0,120,3")]
pub struct Args {
    /// Tree files that `dibs build` wrote, at most 16: a scene
    #[arg(required = true, value_name = "TREE", num_args = 1..=16)]
    trees: Vec<PathBuf>,
    /// sphere:X,Y,Z,R or capsule:X1,Y1,Z1,X2,Y2,Z2,R; up to eight of them are a chain
    #[arg(long, value_parser = parse_tool, allow_hyphen_values = true, required = true)]
    tool: Vec<ToolSpec>,
    /// List all locally closest pairs whose separation is at most this, too: at most 64 of each tool and surface
    #[arg(long, value_name = "MARGIN")]
    contacts: Option<f32>,
    /// Current positions, one for each vertex of the built mesh: a mesh file, or a .pc2 file with
    /// --frame; by default the rest shape. In a scene, once for each tree, in their order
    #[arg(long)]
    vertices: Vec<PathBuf>,
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
    if args.tool.len() > MOST_TOOLS {
        bail!("{} tools are no chain of at most {MOST_TOOLS}", args.tool.len());
    }
    let (trees, vertices) = (args.trees.len(), args.vertices.len());
    if vertices != 0 && vertices != trees {
        bail!(
            "--vertices is given {vertices} times for {trees} trees: give it once for each, or never"
        );
    }
    let mut best: Option<Answer> = None;
    let mut contacts = Vec::new();
    for number in 0..trees {
        let path = &args.trees[number];
        let bytes = tree_file::load(path)?;
        let answer = match tree_file::validate(&bytes, path)? {
            AnyTree::Narrow(tree) => ask(args, number, &tree, &mut contacts)?,
            AnyTree::Wide(tree) => ask(args, number, &tree, &mut contacts)?,
        };
        if best.as_ref().is_none_or(|best| answer.is_closer(best)) {
            best = Some(answer);
        }
    }
    contacts.sort_by(|a, b| a.contact.separation.total_cmp(&b.contact.separation));
    if let Some(best) = best {
        best.print(args, args.contacts.map(|_| contacts.as_slice()));
    }
    Ok(())
}

struct Answer {
    proximity: Proximity,
    /// Which tree and which tool.
    pair: [usize; 2],
    /// Corners of the triangle, numbered as in the mesh file.
    triangle: [u32; 3],
    /// `None` where the tree has no rest metric to measure with.
    stretch: Option<MeasuredStretch>,
}

/// A contact, of which tree and tool, and the corners of its triangle as in the mesh file.
struct Touch {
    contact: Contact,
    pair: [usize; 2],
    triangle: [u32; 3],
}

fn ask<I: Index>(
    args: &Args,
    number: usize,
    tree: &Tree<'_, I>,
    contacts: &mut Vec<Touch>,
) -> Result<Answer> {
    let name = args.trees[number].display();
    let positions = match args.vertices.get(number) {
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
    let mut options = Options::cold();
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
    let mut best: Option<Answer> = None;
    for (tool, spec) in args.tool.iter().enumerate() {
        let margin = args.contacts;
        let (proximity, touches) = match spec {
            ToolSpec::Sphere(sphere) => closest(tree, &positions, sphere, margin, &options),
            ToolSpec::Capsule(capsule) => closest(tree, &positions, capsule, margin, &options),
        }
        .map_err(|error| anyhow!("{name}: {error}"))?;
        let vertex = |row| tree.vertex_number(row).map_or(row, |vertex| vertex.0);
        let in_mesh = |rows: [u32; 3]| rows.map(vertex);
        let pair = [number, tool];
        contacts.extend(touches.into_iter().map(|contact| {
            let triangle = in_mesh(contact.corners);
            Touch { contact, pair, triangle }
        }));
        let triangle = in_mesh(proximity.corners);
        let answer = Answer { proximity, pair, triangle, stretch };
        if best.as_ref().is_none_or(|best| answer.is_closer(best)) {
            best = Some(answer);
        }
    }
    best.ok_or_else(|| anyhow!("no tool"))
}

fn closest<I: Index>(
    tree: &Tree<'_, I>,
    positions: &[Vec3],
    tool: &impl Tool,
    margin: Option<f32>,
    options: &Options,
) -> Result<(Proximity, Vec<Contact>)> {
    let mut query = Query::<I, STACK>::new(tree)?;
    let Some(margin) = margin else {
        return Ok((query.closest(positions, tool, options)?, Vec::new()));
    };
    let mut contacts = Box::new(Contacts::<64, 16_384>::new());
    let closest = query.contacts(positions, tool, margin, options, &mut contacts)?;
    if contacts.bound() < margin {
        eprintln!(
            "warning: only contacts with a separation below {} are all listed",
            contacts.bound()
        );
    }
    Ok((closest, contacts.iter().copied().collect()))
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
        // The tree is of the largest component: others are no error here.
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
            let vertex = tree.vertex_number(row).map_or(row, |number| number.0);
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

/// The side's name, or why there is none.
pub fn side_name(side: Side) -> (&'static str, Option<String>) {
    match side {
        Side::Outside => ("outside", None),
        Side::Inside => ("inside", None),
        Side::Crossing => ("crossing", None),
        Side::Undefined(reason) => ("undefined", Some(reason.to_string())),
        _ => ("undefined", None),
    }
}

impl Answer {
    fn is_closer(&self, other: &Self) -> bool {
        self.proximity.separation < other.proximity.separation
    }

    fn print(&self, args: &Args, contacts: Option<&[Touch]>) {
        let p = &self.proximity;
        let [tree, tool] = self.pair;
        let tree = args.trees[tree].display().to_string();
        let (side, reason) = side_name(p.side);
        if args.json {
            let mut answer = serde_json::json!({
                "separation": p.separation,
                "lower": p.lower,
                "accuracy": p.accuracy,
                "side": side,
                "side_reason": reason,
                "axis_distance": p.axis_distance,
                "point_on_surface": p.point_on_surface.to_array(),
                "point_on_tool": p.point_on_tool.to_array(),
                "direction": p.direction.to_array(),
                "axis_parameter": p.axis_parameter,
                "tree": tree,
                "tool": tool,
                "triangle": self.triangle,
                "barycentric": p.barycentric,
                "stretch": self.stretch.map(|measured| measured.sigma()),
                "node_tests": p.node_tests,
                "triangle_tests": p.triangle_tests,
            });
            if let Some(contacts) = contacts {
                answer["contacts"] = contacts.iter().map(|touch| touch.json(args)).collect();
            }
            println!("{answer:#}");
            return;
        }
        println!("separation        {} (within {:.1e})", p.separation, p.accuracy);
        match reason {
            Some(reason) => println!("side              {side}: {reason}"),
            None => println!("side              {side}"),
        }
        if args.trees.len() > 1 {
            println!("surface           {tree}");
        }
        if args.tool.len() > 1 {
            println!("tool              number {tool} from 0");
        }
        println!("point on surface  {}", p.point_on_surface);
        println!("point on tool     {}", p.point_on_tool);
        println!("triangle          {:?}, weights {:?}", self.triangle, p.barycentric);
        if let Some(measured) = self.stretch {
            println!("stretch           {}", measured.sigma());
        }
        println!("tests             {} nodes, {} triangles", p.node_tests, p.triangle_tests);
        for touch in contacts.unwrap_or_default() {
            let Contact { separation, point_on_surface, normal, .. } = touch.contact;
            println!("contact           {separation} at {point_on_surface}, normal {normal}");
        }
    }
}

impl Touch {
    fn json(&self, args: &Args) -> serde_json::Value {
        let [tree, tool] = self.pair;
        serde_json::json!({
            "separation": self.contact.separation,
            "point_on_surface": self.contact.point_on_surface.to_array(),
            "point_on_tool": self.contact.point_on_tool.to_array(),
            "normal": self.contact.normal.to_array(),
            "triangle": self.triangle,
            "tree": args.trees[tree].display().to_string(),
            "tool": tool,
        })
    }
}

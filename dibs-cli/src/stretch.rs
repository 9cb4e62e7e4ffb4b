//! `dibs stretch`: the stretch limits that a recorded motion needs.

use crate::construction::ConstructionArgs;
use crate::mesh_file::{self, MeshArgs};
use crate::motion::MotionFile;
use crate::nodes::{self, VolumeSpec};
use crate::overwrite;
use anyhow::{Context, Result, anyhow, bail};
use dibs_build::{
    Mesh, Motion, MotionStretch, Paths, PeakStretch, Volume, write_atomically, write_limits,
};
use plotters::prelude::*;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(mut_arg("motion", |motion| motion.required(true)), after_help = "\
Examples:
  dibs stretch heart.ply --motion heart.pc2
  dibs stretch heart.ply --motion heart.pc2 --margin 0.1 --limits heart.limits --picture stretch.svg
  dibs build heart.ply -o heart.dibs --limits heart.limits --motion heart.pc2
  dibs stretch heart.ply --nodes heart-fem.msh --motion nodes.npy --limits heart.limits

A triangle's stretch is the largest singular value of its deformation gradient against the mesh file, or
with --construction paper the longest of its edges over that edge's length there; a tetrahedron's is the same. Give the same options for reading
the mesh as to `dibs build`.")]
pub struct Args {
    /// The rest shape: a mesh file, as for `dibs build`
    mesh: PathBuf,
    /// The volume whose nodes move the surface, as for `dibs build`: the motion holds the nodes' positions, and each
    /// tetrahedron has a limit
    #[arg(long, value_name = "VOLUME", value_parser = nodes::parse, conflicts_with = "construction")]
    nodes: Option<VolumeSpec>,
    #[command(flatten)]
    motion: MotionFile,
    /// Margin of the limits above the recorded stretch (0.1: a tenth of it)
    #[arg(long, default_value_t = 0.1)]
    margin: f32,
    /// Write a limit for each triangle or tetrahedron, for `dibs build --limits`
    #[arg(long, value_name = "LIMITS")]
    limits: Option<PathBuf>,
    /// Draw an SVG of how many of them stretch how far
    #[arg(long)]
    picture: Option<PathBuf>,
    #[command(flatten)]
    construction: ConstructionArgs,
    /// `--construction paper` in earlier versions
    #[arg(long, hide = true, conflicts_with = "construction")]
    edges: bool,
    #[command(flatten)]
    reading: MeshArgs,
    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

/// Percentages of the triangles whose largest stretch is reported.
const PERCENTILES: [f64; 6] = [50.0, 90.0, 99.0, 99.9, 99.99, 100.0];

/// Number of most stretched triangles that are listed.
const NAMED: usize = 5;

pub fn run(args: &Args) -> Result<()> {
    if !(0.0..=1000.0).contains(&args.margin) {
        bail!(
            "a margin of {} makes no sense: it is a part of at least 0 (0.1: a tenth)",
            args.margin
        );
    }
    let path = args.motion.required()?;
    let volume = args.nodes.as_ref().and_then(VolumeSpec::file);
    let inputs = [&args.mesh, path].into_iter().chain(volume);
    overwrite::check(inputs, args.limits.iter().chain(&args.picture))?;
    let import = mesh_file::read(&args.mesh, &args.reading, false)?;
    let mesh = &import.mesh;
    let lengths = &args.reading.lengths;
    let motion = match &args.nodes {
        Some(_) => lengths.motion_of_nodes(path, mesh.origin),
        None => lengths.motion(path, mesh.origin),
    }?;
    let paths = if args.edges { Paths::Edges } else { args.construction.paths() };
    let volume = args.nodes.as_ref().map(|nodes| nodes.volume(mesh, lengths)).transpose()?;
    // The limits are right, but `dibs build` may refuse the volume.
    let held = volume.as_ref().map_or(Ok(()), |volume| volume.check_surface(mesh));
    if let (Some(nodes), Err(error)) = (&args.nodes, held) {
        eprintln!("warning: {nodes}: {error}");
    }
    let elements = volume.as_ref().map_or(Elements::Triangles(mesh), Elements::Tetrahedra);
    let needed = match &volume {
        Some(volume) => MotionStretch::of_nodes(volume, &motion, &|_| ())
            .map_err(|error| anyhow!("{}: {error}", path.display()))?,
        None => measure(mesh, &motion, path, paths)?,
    };
    let (one, all) = elements.names();
    let ranked = needed.ranked();
    let limits = needed.limits(args.margin);
    if let Some(limits_file) = &args.limits {
        let comment = format!(
            "Stretch limits of the {all} of {}: what {} needs, and {} of it more.",
            args.mesh.display(),
            path.display(),
            args.margin
        );
        match elements {
            Elements::Triangles(mesh) => write_limits(limits_file, mesh, &limits, &comment)?,
            Elements::Tetrahedra(volume) => volume.write_limits(limits_file, &limits, &comment)?,
        }
    }
    if let Some(path) = &args.picture {
        let picture = draw(&ranked, all).with_context(|| path.display().to_string())?;
        write_atomically(path, |out| out.write_all(picture.as_bytes()))?;
    }
    let percentiles = PERCENTILES.map(|share| (share, percentile(&ranked, share)));
    let uniform = limits.iter().copied().fold(1.0, f32::max);
    let worst = ranked.get(..NAMED).unwrap_or(&ranked);
    if args.json {
        let worst = worst.iter().map(|needed| elements.named(needed)).collect::<Vec<_>>();
        println!(
            "{:#}",
            serde_json::json!({
                "mesh": import.report, "frames": motion.frames.len(), "margin": args.margin,
                "percentiles": percentiles, "worst": worst, "uniform_limit": uniform,
                "limits": args.limits, "picture": args.picture,
            })
        );
        return Ok(());
    }
    println!("read     {}: {}", args.mesh.display(), import.report);
    println!("motion   {}: {} frames", path.display(), motion.frames.len());
    for (share, stretch) in percentiles {
        println!("stretch  {share:6} % of the {all} stretch by at most {stretch:.4}");
    }
    for &PeakStretch { triangle, stretch, frame } in worst {
        let corners = elements.corners(triangle);
        let corners = corners.iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
        let points = if volume.is_some() { "nodes" } else { "vertices" };
        println!("worst    {one} {triangle} ({points} {corners}): {stretch:.4} in frame {frame}");
    }
    println!("needs    with a margin of {}: --stretch {uniform:.4} for all alike", args.margin);
    match &args.limits {
        Some(path) => println!("written  {}: a limit for each {one}", path.display()),
        None => println!("         or a limit for each {one}: --limits FILE"),
    }
    if let Some(path) = &args.picture {
        println!("written  {}", path.display());
    }
    Ok(())
}

/// Measures a motion, with a progress bar.
pub fn measure(mesh: &Mesh, motion: &Motion, path: &Path, paths: Paths) -> Result<MotionStretch> {
    let bar = mesh_file::progress_bar("measuring", mesh.triangles.len());
    let needed = MotionStretch::new(mesh, motion, paths, &|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    needed.map_err(|error| anyhow!("{}: {error}", path.display()))
}

/// The stretch that this percentage of the triangles does not exceed.
fn percentile(ranked: &[PeakStretch], share: f64) -> f64 {
    let beyond = ((1.0 - share / 100.0) * ranked.len() as f64).floor() as usize;
    ranked[beyond.min(ranked.len() - 1)].stretch
}

/// The elements whose stretch is measured.
#[derive(Clone, Copy)]
enum Elements<'m> {
    Triangles(&'m Mesh),
    Tetrahedra(&'m Volume),
}

impl Elements<'_> {
    /// Their name in singular and plural.
    const fn names(&self) -> (&'static str, &'static str) {
        match self {
            Self::Triangles(_) => ("triangle", "triangles"),
            Self::Tetrahedra(_) => ("tetrahedron", "tetrahedra"),
        }
    }

    /// The vertices or nodes of an element.
    fn corners(&self, number: usize) -> Vec<u32> {
        match self {
            Self::Triangles(mesh) => mesh.triangles[number].to_vec(),
            Self::Tetrahedra(volume) => volume.tetrahedra()[number].to_vec(),
        }
    }

    fn named(&self, &PeakStretch { triangle, stretch, frame }: &PeakStretch) -> serde_json::Value {
        let corners = self.corners(triangle);
        match self {
            Self::Triangles(_) => serde_json::json!({
                "triangle": triangle, "vertices": corners, "stretch": stretch, "frame": frame
            }),
            Self::Tetrahedra(_) => serde_json::json!({
                "tetrahedron": triangle, "nodes": corners, "stretch": stretch, "frame": frame
            }),
        }
    }
}

/// Draws the fraction of the triangles that stretch beyond each value, as SVG.
fn draw(ranked: &[PeakStretch], all: &str) -> Result<String> {
    let mut picture = String::new();
    {
        let root = SVGBackend::with_string(&mut picture, (900, 420)).into_drawing_area();
        root.fill(&WHITE)?;
        let count = ranked.len() as f64;
        let share = |beyond: usize| 100.0 * beyond as f64 / count;
        let most = ranked[0].stretch.max(1.01);
        let mut chart = ChartBuilder::on(&root)
            .margin(14)
            .x_label_area_size(40)
            .y_label_area_size(70)
            .build_cartesian_2d(1.0..most * 1.02, (share(1) * 0.7..100.0).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("largest stretch in the motion")
            .y_desc(format!("{all} beyond (%)"))
            .light_line_style(TRANSPARENT)
            .draw()?;
        let points = ranked.iter().enumerate().map(|(i, n)| (n.stretch.max(1.0), share(i + 1)));
        let step = ranked.len().div_ceil(1_500);
        // All points of the tail, and some of the rest.
        let kept = points.enumerate().filter(|(i, _)| i % step == 0 || *i < 100).map(|(_, p)| p);
        chart.draw_series(LineSeries::new(kept, RGBColor(31, 90, 160).stroke_width(2)))?;
        root.present()?;
    }
    Ok(picture)
}

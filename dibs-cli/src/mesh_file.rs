//! Reading a mesh file on the command line.

use anyhow::{Result, anyhow};
use dibs_build::glam::DVec3;
use dibs_build::{FrameCheck, Import, Motion, ReadOptions, Unit};
use dibs_nostd::{Index, PathKind, Tree};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use std::time::Duration;

/// How a mesh file is read.
#[derive(clap::Args)]
pub struct MeshArgs {
    /// Fail on degenerate and duplicate triangles, instead of dropping them
    #[arg(long)]
    strict: bool,
    /// Weld vertices at most this far apart (0: equal ones); by default only triangle soup is welded, exactly
    #[arg(long, value_name = "TOLERANCE")]
    weld: Option<f32>,
    /// Keep only the largest of several separate surfaces
    #[arg(long)]
    largest_component: bool,
    /// The point of the mesh's file, in millimetres, that the tree's coordinates are relative to; by default 0,0,0, or
    /// the mesh's centre where f32 would lose digits so far from the file's own origin
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    origin: Option<DVec3>,
    #[command(flatten)]
    pub lengths: Lengths,
}

/// The unit of files of meshes and motions.
#[derive(clap::Args)]
pub struct Lengths {
    /// Unit of the lengths in files of meshes and motions, which are converted to millimetres; by default the one that
    /// the file states (glTF: metres; 3MF), else mm
    #[arg(long, value_enum)]
    unit: Option<UnitName>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum UnitName {
    Mm,
    Cm,
    M,
    In,
    Um,
}

impl Lengths {
    /// The given unit.
    pub fn unit(&self) -> Option<Unit> {
        self.unit.map(|unit| match unit {
            UnitName::Mm => Unit::Millimetre,
            UnitName::Cm => Unit::Centimetre,
            UnitName::M => Unit::Metre,
            UnitName::In => Unit::Inch,
            UnitName::Um => Unit::Micrometre,
        })
    }

    /// Reads a motion in this unit, of a mesh with this origin.
    pub fn motion(&self, path: &Path, origin: DVec3) -> Result<Motion> {
        Ok(Motion::read_around(path, self.unit(), origin)?)
    }

    /// The same, of a volume's nodes.
    pub fn motion_of_nodes(&self, path: &Path, origin: DVec3) -> Result<Motion> {
        Ok(Motion::read_nodes_around(path, self.unit(), origin)?)
    }

    /// Reads a motion in this unit, of the surface of a tree.
    pub fn motion_of<I: Index>(&self, tree: &Tree<'_, I>, path: &Path) -> Result<Motion> {
        let origin = tree.origin().into();
        let motion = match tree.paths() {
            PathKind::Volume => self.motion_of_nodes(path, origin),
            _ => self.motion(path, origin),
        }?;
        let faces = FrameCheck::of(tree).check_faces(&motion.faces);
        faces.map_err(|error| anyhow!("{}: {error}", path.display())).map(|()| motion)
    }
}

/// Parses `X,Y,Z`.
fn parse_point(text: &str) -> Result<DVec3> {
    let numbers = text.split(',').map(|number| number.trim().parse::<f64>());
    match numbers.collect::<std::result::Result<Vec<_>, _>>().as_deref() {
        Ok(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err(anyhow!("expected X,Y,Z")),
    }
}

/// Reads a mesh, with labels of its file's groups if `groups` is set, and prints its warnings on standard error.
pub fn read(path: &Path, args: &MeshArgs, groups: bool) -> Result<Import> {
    let options = ReadOptions {
        weld_tolerance: args.weld,
        strict: args.strict,
        largest_component: args.largest_component,
        unit: args.lengths.unit(),
        origin: args.origin,
        groups,
    };
    let import = options.read(path)?;
    for warning in import.report.warnings() {
        eprintln!("warning: {}: {warning}", path.display());
    }
    Ok(import)
}

/// A progress bar for work on this many triangles.
pub fn progress_bar(doing: &str, triangles: usize) -> ProgressBar {
    let bar = ProgressBar::new(triangles as u64);
    let template = format!("{doing} {{bar:40}} {{percent}}% {{elapsed}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}

/// A sign of activity during work whose progress is unknown.
pub fn spinner(doing: &'static str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(doing);
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}

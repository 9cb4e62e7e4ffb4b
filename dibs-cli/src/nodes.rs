//! Volumes whose nodes move a surface, on the command line.

use crate::mesh_file::Lengths;
use crate::query::ALLOW;
use anyhow::{Context, Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_build::{BuiltTree, FrameCheck, Mesh, SurfaceRows, Volume};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, PathKind, Tree};
use std::fmt;
use std::path::{Path, PathBuf};

/// The argument `VOLUME`: a file, or `lattice:NX,NY,NZ`.
#[derive(Clone, Debug)]
pub enum VolumeSpec {
    File(PathBuf),
    Lattice([u32; 3]),
}

/// Parses the argument of `--nodes`.
pub fn parse(text: &str) -> Result<VolumeSpec> {
    if text.is_empty() {
        bail!("expected a file of tetrahedra, or lattice:NX,NY,NZ");
    }
    let Some(cells) = text.strip_prefix("lattice:") else {
        return Ok(VolumeSpec::File(text.into()));
    };
    let numbers = cells.split(',').map(|number| number.trim().parse::<u32>());
    match numbers.collect::<Result<Vec<_>, _>>().as_deref() {
        Ok(&[x, y, z]) => Ok(VolumeSpec::Lattice([x, y, z])),
        _ => Err(anyhow!("expected lattice:NX,NY,NZ, the cells along each axis")),
    }
}

/// Parses the argument of `--bind-within`.
pub fn parse_distance(text: &str) -> Result<f64> {
    // Written so that NaN is refused.
    text.parse()
        .ok()
        .filter(|distance| *distance >= 0.0)
        .context("expected a distance of at least 0")
}

/// What it is called in an error.
impl fmt::Display for VolumeSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Lattice([x, y, z]) => write!(f, "--nodes lattice:{x},{y},{z}"),
        }
    }
}

impl VolumeSpec {
    /// The file, if it is one.
    pub fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::File(path) => Some(path),
            Self::Lattice(_) => None,
        }
    }

    /// Reads or makes the volume for a mesh.
    pub fn volume(&self, mesh: &Mesh, lengths: &Lengths) -> Result<Volume> {
        match self {
            Self::File(path) => Ok(Volume::read(path, lengths.unit())?),
            Self::Lattice(cells) => {
                Volume::lattice(mesh, *cells).map_err(|error| anyhow!("{self}: {error}"))
            }
        }
    }
}

/// An error unless the tree's stretch limit covers a recorded motion of its nodes.
pub fn check_covered(tree: &BuiltTree, path: &Path, lengths: &Lengths) -> Result<()> {
    let motion = lengths.motion_of_nodes(path, tree.origin())?;
    match tree.index_bits() {
        16 => check_frames(&tree.tree::<u16>()?, path, &motion.frames),
        _ => check_frames(&tree.tree::<u32>()?, path, &motion.frames),
    }
}

/// An error for the first of a motion's frames that a receiver of nodes refuses; none for a tree without nodes.
pub fn check_frames<I: Index>(tree: &Tree<'_, I>, path: &Path, frames: &[Vec<Vec3>]) -> Result<()> {
    if tree.paths() != PathKind::Volume {
        return Ok(());
    }
    let check = FrameCheck::of(tree);
    for (number, frame) in frames.iter().enumerate() {
        let at = || format!("{}, frame {number}", path.display());
        let rows = check.to_rows(frame).map_err(|error| anyhow!("{}: {error}", at()))?;
        if let Err(error) = Nodes::of(tree)?.measure(rows.as_slice()) {
            bail!("{}: {}", at(), SurfaceRows::refusal(tree, error, ALLOW));
        }
    }
    Ok(())
}

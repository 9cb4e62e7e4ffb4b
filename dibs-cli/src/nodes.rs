//! Volumes whose nodes move a surface, on the command line.

use crate::mesh_file::Lengths;
use crate::query::ALLOW;
use anyhow::{Context, Error, Result, anyhow, bail};
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
    match tree.index_bits() {
        16 => check_motion(&tree.tree::<u16>()?, path, lengths),
        _ => check_motion(&tree.tree::<u32>()?, path, lengths),
    }
}

fn check_motion<I: Index>(tree: &Tree<'_, I>, path: &Path, lengths: &Lengths) -> Result<()> {
    let check = FrameCheck::of(tree);
    for (number, frame) in lengths.motion_of(tree, path)?.frames.iter().enumerate() {
        let rows = check.to_rows(frame).map_err(Error::from);
        rows.and_then(|rows| check_rows(tree, &rows))
            .map_err(|error| anyhow!("{}, frame {number}: {error}", path.display()))?;
    }
    Ok(())
}

/// An error for a frame, in the tree's rows, that a receiver of nodes refuses; none for a tree without nodes.
pub fn check_rows<I: Index>(tree: &Tree<'_, I>, rows: &[Vec3]) -> Result<()> {
    if tree.paths() != PathKind::Volume {
        return Ok(());
    }
    match Nodes::of(tree)?.measure(rows) {
        Ok(_) => Ok(()),
        Err(error) => bail!(SurfaceRows::refusal(tree, error, ALLOW)),
    }
}

//! The file that `dibs stretch` writes and `dibs build` reads: a limit for each triangle, or tetrahedron of a volume.
//!
//! Text: lines that start with `#` are comments; then `dibs-limits 1`, `mesh` with the mesh's checksum in hexadecimal
//! digits, `triangles` with their number, and one limit a line, in the mesh's order. For a volume the keyword is
//! `tetrahedra`, and the order is the volume's.

use std::path::{Path, PathBuf};

use dibs_nostd::format::CRC;
use glam::{DVec3, Vec3};
use thiserror::Error;

use crate::read::file;
use crate::{Mesh, Volume, WriteError, write_atomically};

/// A file of limits that cannot be used.
#[derive(Debug, Error)]
#[error("{}: {kind}", path.display())]
pub struct LimitsError {
    /// The file.
    pub path: PathBuf,
    /// The defect.
    pub kind: LimitsErrorKind,
}

/// A defect of a file of limits.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LimitsErrorKind {
    /// The operating system's error.
    #[error("cannot be read ({0})")]
    Io(#[from] std::io::Error),
    /// It does not start as a file of limits.
    #[error(
        "is no file of stretch limits: `dibs stretch MESH --motion MOTION --limits FILE` writes one"
    )]
    NotLimits,
    /// The limits are for the other kind of element. Where a volume moves the surface, limits are of its tetrahedra;
    /// otherwise they are of the surface's triangles.
    #[error("has limits of {found}, and those of {expected} are needed: {}", remedy(found))]
    OtherKind {
        /// `triangles`, or `tetrahedra` if a volume moves the surface.
        expected: &'static str,
        /// The kind in the file.
        found: &'static str,
    },
    /// The limits are of another mesh.
    #[error(
        "is of mesh {found:08x}, this one is {expected:08x}: write it anew for this mesh or volume, with \
         the same options for reading it"
    )]
    OtherMesh {
        /// Checksum of the mesh.
        expected: u32,
        /// Checksum in the file.
        found: u32,
    },
    /// The number of limits differs from the number of triangles or tetrahedra.
    #[error("has {found} limits, {expected} are needed: it is cut off or was edited")]
    Count {
        /// Triangles of the mesh, or tetrahedra of the volume.
        expected: usize,
        /// Limits in the file.
        found: usize,
    },
    /// A line is not a limit.
    #[error("line {line}: '{text}' is not a limit: a number of at least 1")]
    Line {
        /// The line, counted from 1.
        line: usize,
        /// Its text.
        text: String,
    },
}

fn remedy(found: &str) -> &'static str {
    if found == TETRAHEDRA {
        "give the volume as well (--nodes VOLUME), or the file of `dibs stretch MESH --motion MOTION --limits FILE`"
    } else {
        "leave --nodes out, or give the file of `dibs stretch MESH --nodes VOLUME --motion MOTION --limits FILE`"
    }
}

const TRIANGLES: &str = "triangles";
const TETRAHEDRA: &str = "tetrahedra";

/// Writes limits for the triangles of a mesh, after a comment.
///
/// # Errors
/// [`WriteError`]; the file is complete or untouched.
///
/// # Panics
/// If the number of limits differs from the number of triangles.
pub fn write_limits(
    path: impl AsRef<Path>,
    mesh: &Mesh,
    limits: &[f32],
    comment: &str,
) -> Result<(), WriteError> {
    LimitedElements::triangles(mesh).write(path.as_ref(), limits, comment)
}

/// Reads the limits of a mesh's triangles.
///
/// # Errors
/// [`LimitsError`] names the file and its defect, such as limits of another mesh.
pub fn read_limits(path: impl AsRef<Path>, mesh: &Mesh) -> Result<Vec<f32>, LimitsError> {
    LimitedElements::triangles(mesh).read(path.as_ref())
}

impl Volume {
    /// Writes limits for the volume's tetrahedra, after a comment.
    ///
    /// # Errors
    /// [`WriteError`]; the file is complete or untouched.
    ///
    /// # Panics
    /// If the number of limits differs from the number of tetrahedra.
    pub fn write_limits(
        &self,
        path: impl AsRef<Path>,
        limits: &[f32],
        comment: &str,
    ) -> Result<(), WriteError> {
        LimitedElements::tetrahedra(self).write(path.as_ref(), limits, comment)
    }

    /// Reads the limits of the volume's tetrahedra.
    ///
    /// # Errors
    /// [`LimitsError`] names the file and its defect, such as limits of another volume.
    pub fn read_limits(&self, path: impl AsRef<Path>) -> Result<Vec<f32>, LimitsError> {
        LimitedElements::tetrahedra(self).read(path.as_ref())
    }
}

/// The mesh or volume whose limits a file holds.
struct LimitedElements {
    elements: &'static str,
    count: usize,
    checksum: u32,
}

impl LimitedElements {
    fn triangles(mesh: &Mesh) -> Self {
        let mut digest = CRC.digest();
        mesh.positions
            .iter()
            .flat_map(Vec3::to_array)
            .for_each(|x| digest.update(&x.to_le_bytes()));
        mesh.triangles.iter().flatten().for_each(|corner| digest.update(&corner.to_le_bytes()));
        Self { elements: TRIANGLES, count: mesh.triangles.len(), checksum: digest.finalize() }
    }

    fn tetrahedra(volume: &Volume) -> Self {
        let mut digest = CRC.digest();
        volume
            .nodes()
            .iter()
            .flat_map(DVec3::to_array)
            .for_each(|x| digest.update(&x.to_le_bytes()));
        volume
            .tetrahedra()
            .iter()
            .flatten()
            .for_each(|corner| digest.update(&corner.to_le_bytes()));
        Self { elements: TETRAHEDRA, count: volume.tetrahedra().len(), checksum: digest.finalize() }
    }

    fn write(&self, path: &Path, limits: &[f32], comment: &str) -> Result<(), WriteError> {
        let Self { elements, count, checksum } = self;
        assert_eq!(limits.len(), *count, "a limit for each of the {elements}");
        write_atomically(path, |out| {
            for line in comment.lines() {
                writeln!(out, "# {line}")?;
            }
            writeln!(out, "dibs-limits 1\nmesh {checksum:08x}\n{elements} {count}")?;
            // The shortest digits that give the same number back.
            limits.iter().try_for_each(|limit| writeln!(out, "{limit}"))
        })
    }

    fn read(&self, path: &Path) -> Result<Vec<f32>, LimitsError> {
        let text = file::text(path).map_err(LimitsErrorKind::from);
        text.and_then(|text| parse(&text, self))
            .map_err(|kind| LimitsError { path: path.to_path_buf(), kind })
    }
}

fn parse(text: &str, of: &LimitedElements) -> Result<Vec<f32>, LimitsErrorKind> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.starts_with('#') && !line.is_empty());
    let mut field = |name: &str| {
        let (_, line) = lines.next()?;
        line.strip_prefix(name)?.strip_prefix(' ')
    };
    if field("dibs-limits") != Some("1") {
        return Err(LimitsErrorKind::NotLimits);
    }
    let found = field("mesh").and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let counted = lines.next().and_then(|(_, line)| line.split_once(' '));
    let count = counted.and_then(|(_, digits)| digits.parse::<usize>().ok());
    let (Some(found), Some((elements, _)), Some(count)) = (found, counted, count) else {
        return Err(LimitsErrorKind::NotLimits);
    };
    match [TRIANGLES, TETRAHEDRA].into_iter().find(|&kind| kind == elements) {
        Some(kind) if kind == of.elements => {}
        Some(found) => return Err(LimitsErrorKind::OtherKind { expected: of.elements, found }),
        None => return Err(LimitsErrorKind::NotLimits),
    }
    if found != of.checksum {
        return Err(LimitsErrorKind::OtherMesh { expected: of.checksum, found });
    }
    let limit = |(line, text): (usize, &str)| match text.parse::<f32>() {
        Ok(limit) if (1.0..=1e6).contains(&limit) => Ok(limit),
        _ => Err(LimitsErrorKind::Line { line, text: text.to_owned() }),
    };
    let limits = lines.map(limit).collect::<Result<Vec<f32>, _>>()?;
    if limits.len() != of.count || count != of.count {
        return Err(LimitsErrorKind::Count { expected: of.count, found: limits.len() });
    }
    Ok(limits)
}

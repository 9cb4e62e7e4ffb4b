//! The labels that `dibs build --labels` reads: one for each face of the file, or each triangle of the mesh.
//!
//! Text: lines that start with `#` and empty ones are skipped; then one number from 0 to 255 a line, in the file's order.

// Requirement: A-12

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::RestSurface;
use crate::read::file;

/// A file of labels that cannot be used.
#[derive(Debug, Error)]
#[error("{}: {kind}", path.display())]
pub struct LabelsError {
    /// The file.
    pub path: PathBuf,
    /// The defect.
    pub kind: LabelsErrorKind,
}

/// A defect of a file of labels.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LabelsErrorKind {
    /// The operating system's error.
    #[error("cannot be read ({0})")]
    Io(#[from] std::io::Error),
    /// The number of labels differs from the number of triangles.
    #[error("has {found} labels for {expected} triangles{}: give one for each", of_faces(*.faces))]
    Count {
        /// Triangles of the mesh.
        expected: usize,
        /// Faces of the mesh's file, if they differ from the triangles.
        faces: Option<usize>,
        /// Labels in the file.
        found: usize,
    },
    /// The mesh's file has as many faces as the mesh has triangles, but some faces were dropped and others cut up.
    #[error(
        "has {found} labels, for the faces of the mesh's file or for the triangles left of it: mend the mesh, \
         so that none is dropped (--strict names them)"
    )]
    Ambiguous {
        /// Labels in the file.
        found: usize,
    },
    /// A line is not a label.
    #[error("line {line}: '{text}' is not a label: a whole number from 0 to 255")]
    Line {
        /// The line, counted from 1.
        line: usize,
        /// Its text.
        text: String,
    },
}

fn of_faces(faces: Option<usize>) -> String {
    faces.map(|faces| format!(" of a file with {faces} faces")).unwrap_or_default()
}

/// Reads the labels of a surface's triangles: text, one number from 0 to 255 a line, `#` before a comment. There is one
/// for each face of the surface's file, where labels of dropped faces are ignored; or one for each triangle.
///
/// # Errors
/// [`LabelsError`] names the file and its defect.
pub fn read_labels(
    path: impl AsRef<Path>,
    surface: &(impl RestSurface + ?Sized),
) -> Result<Vec<u8>, LabelsError> {
    let path = path.as_ref();
    let text = file::text(path).map_err(LabelsErrorKind::from);
    text.and_then(|text| for_triangles(parse(&text)?, surface))
        .map_err(|kind| LabelsError { path: path.to_path_buf(), kind })
}

fn for_triangles(
    labels: Vec<u8>,
    surface: &(impl RestSurface + ?Sized),
) -> Result<Vec<u8>, LabelsErrorKind> {
    let (expected, found) = (surface.mesh().triangles.len(), labels.len());
    let is_other = |(faces, count): &(&[u32], usize)| {
        *count != expected || faces.iter().zip(0..).any(|(&face, triangle)| face != triangle)
    };
    let Some((of_triangle, faces)) = surface.file_faces().filter(is_other) else {
        let fits = found == expected;
        return fits.then_some(labels).ok_or(LabelsErrorKind::Count {
            expected,
            faces: None,
            found,
        });
    };
    match (found == faces, found == expected) {
        (true, true) => Err(LabelsErrorKind::Ambiguous { found }),
        (true, false) => Ok(of_triangle.iter().map(|&face| labels[face as usize]).collect()),
        (false, true) => Ok(labels),
        (false, false) => Err(LabelsErrorKind::Count { expected, faces: Some(faces), found }),
    }
}

fn parse(text: &str) -> Result<Vec<u8>, LabelsErrorKind> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let labels = lines.filter(|(_, text)| !text.starts_with('#') && !text.is_empty());
    let label = |(line, text): (usize, &str)| {
        text.parse::<u8>().map_err(|_| LabelsErrorKind::Line { line, text: text.to_owned() })
    };
    labels.map(label).collect()
}

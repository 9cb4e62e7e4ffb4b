//! The file of labels that `dibs build --labels` reads: one for each triangle of a mesh.
//!
//! Text: lines that start with `#` and empty ones are skipped; then one number from 0 to 255 a line, in the mesh's order.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::Mesh;

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
    /// The number of labels differs from that of triangles.
    #[error(
        "has {found} labels for {expected} triangles: give one for each triangle of the mesh as read, without those that \
         were dropped"
    )]
    Count {
        /// Triangles of the mesh.
        expected: usize,
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

/// Reads the labels of a mesh's triangles: text, one number from 0 to 255 a line, `#` before a comment.
///
/// # Errors
/// [`LabelsError`] names the file and its defect.
pub fn read_labels(path: impl AsRef<Path>, mesh: &Mesh) -> Result<Vec<u8>, LabelsError> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(LabelsErrorKind::from);
    text.and_then(|text| parse(&text, mesh.triangles.len()))
        .map_err(|kind| LabelsError { path: path.to_path_buf(), kind })
}

fn parse(text: &str, expected: usize) -> Result<Vec<u8>, LabelsErrorKind> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let labels = lines.filter(|(_, text)| !text.starts_with('#') && !text.is_empty());
    let label = |(line, text): (usize, &str)| {
        text.parse::<u8>().map_err(|_| LabelsErrorKind::Line { line, text: text.to_owned() })
    };
    let labels = labels.map(label).collect::<Result<Vec<u8>, _>>()?;
    if labels.len() != expected {
        return Err(LabelsErrorKind::Count { expected, found: labels.len() });
    }
    Ok(labels)
}

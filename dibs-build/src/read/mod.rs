//! Mesh files: OBJ, STL, PLY and OFF, recognised by their contents.

mod check;
mod error;
mod obj;
mod off;
mod ply;
mod polygon;
mod raw;
mod report;
mod sniff;
mod stl;
mod weld;

pub use error::{ReadError, ReadErrorKind};
pub use report::{Format, Report};

use crate::mesh::{Mesh, RestSurface};
use crate::rounding::round_up;
use std::path::Path;

/// A mesh that passed every check, and the report of findings and repairs.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The surface: one connected component, no degenerate and no duplicate triangle.
    pub mesh: Mesh,
    /// Counts of the elements read, welded, dropped and found.
    pub report: Report,
}

/// How to read a mesh file. [`read`] uses the defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// Weld vertices that are at most this far apart, in the mesh's unit; 0 welds those with
    /// exactly equal f32 coordinates (`-0.0` equals `0.0`).
    ///
    /// `None` decides by the file: triangle soup (STL, and an indexed file in which no two faces
    /// share a vertex) is welded exactly; an indexed file that does share vertices is believed,
    /// because two sheets of tissue that touch in the rest shape may part later. The
    /// [`Report`] counts the coincident vertices that were left apart.
    pub weld_tolerance: Option<f32>,
    /// Make degenerate and duplicate triangles an error, instead of dropping and counting them.
    pub strict: bool,
    /// Keep the component with the most triangles, instead of failing when there are several.
    pub largest_component: bool,
}

impl RestSurface for Import {
    fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    fn position_error(&self) -> f32 {
        round_up(self.report.position_error)
    }
}

impl Import {
    /// The default options, to be changed and then used with [`ReadOptions::read`].
    #[must_use]
    pub fn options() -> ReadOptions {
        ReadOptions::default()
    }
}

impl ReadOptions {
    /// Reads and checks a mesh file. See [`read`].
    ///
    /// # Errors
    /// As [`read`]; with `strict` also for degenerate and duplicate triangles.
    pub fn read(&self, path: impl AsRef<Path>) -> Result<Import, ReadError> {
        let path = path.as_ref();
        let fail = |kind| ReadError { path: path.to_path_buf(), kind };
        let bytes = std::fs::read(path).map_err(|error| fail(error.into()))?;
        self.read_bytes(bytes, path.extension().and_then(|e| e.to_str())).map_err(fail)
    }

    fn read_bytes(&self, bytes: Vec<u8>, extension: Option<&str>) -> Result<Import, ReadErrorKind> {
        if let Some(tolerance) = self.weld_tolerance
            && !(tolerance.is_finite() && tolerance >= 0.0)
        {
            return Err(ReadErrorKind::Tolerance { tolerance });
        }
        let format = sniff::format(&bytes, extension)?;
        let raw = match format {
            Format::Obj => obj::read(&bytes)?,
            Format::StlAscii => stl::read_ascii(&bytes)?,
            Format::StlBinary => stl::read_binary(&bytes)?,
            Format::Ply => ply::read(bytes)?,
            Format::Off => off::read(&bytes)?,
        };
        let mut import = check::import(&raw, format, self)?;
        import.report.extension_disagrees =
            extension.is_some_and(|e| !format.extension().eq_ignore_ascii_case(e));
        Ok(import)
    }
}

/// Reads and checks a mesh file in OBJ, STL (ASCII or binary), PLY (ASCII, little- or big-endian)
/// or OFF, told apart by content. Polygons are triangulated, soup is welded, degenerate and
/// duplicate triangles are dropped and counted.
///
/// Vertex numbers are those of the file, whatever is welded or dropped: a vertex that no triangle
/// uses any more keeps its row in [`Mesh::positions`], so a recorded [`Motion`](crate::Motion)
/// still fits. STL has no vertex numbers: there, distinct positions are numbered in the order in
/// which they first appear.
///
/// The whole file is held in memory, and memory is bounded by the file's size, never by a count
/// that the file claims.
///
/// # Errors
/// [`ReadError`], one sentence that names the file, the offending element and the remedy.
///
/// ```
/// # let path = std::env::temp_dir().join(format!("dibs-doc-{}.obj", std::process::id()));
/// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
/// let import = dibs_build::read(&path)?;
/// assert_eq!(import.mesh.triangles.len(), 2);
/// assert_eq!(import.report.polygons_triangulated, 1);
/// # std::fs::remove_file(path).unwrap();
/// # Ok::<(), dibs_build::ReadError>(())
/// ```
pub fn read(path: impl AsRef<Path>) -> Result<Import, ReadError> {
    ReadOptions::default().read(path)
}

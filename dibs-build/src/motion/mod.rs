//! Recorded motions: one file, PC2 or a NumPy array, or a numbered series of meshes.

mod npy;
mod pc2;
mod series;

pub use pc2::MotionMismatchError;

use crate::read::{FileCoordinates, ReadError, ReadErrorKind, ReadTarget, file};
use crate::{Motion, Unit};
use glam::{DVec3, Vec3};
use std::path::{Path, PathBuf};

/// The files of a series that exist; `None` if the path does not name a series.
pub(crate) fn series_files(path: &Path) -> Option<Vec<PathBuf>> {
    let files = series::Series::named(path)?.files().unwrap_or_default();
    Some(files.into_iter().map(|(_, file)| file).collect())
}

impl Motion {
    /// Reads a motion: a PC2 file, a NumPy array (.npy) of frames x vertices (or nodes) x 3, or a numbered series of mesh
    /// files, named as `heart_%03d.vtp` (`%d` takes numbers with or without leading zeros). The mesh's
    /// [origin](crate::Mesh::origin) must be zero; for others see [`read_around`](Self::read_around). Only the PC2
    /// files of [`write_pc2`](Self::write_pc2) state the frames a second; for others [`rate`](Self::rate) is 0.
    ///
    /// # Errors
    /// [`ReadError`], one sentence that names the file, the offending element and the remedy. For a series also where a
    /// number is missing, or a frame has other triangles than the first.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        Self::read_around(path, None, DVec3::ZERO)
    }

    /// As [`read`](Self::read), for a motion in `unit` of a mesh with this [origin](crate::Mesh::origin): positions are
    /// converted to millimetres relative to the origin, and only then rounded to f32. `None` means millimetres, or the
    /// unit that the files of a series state.
    ///
    /// # Errors
    /// As [`read`](Self::read). Also for a frame so far from the origin that f32 does not hold its shape.
    pub fn read_around(
        path: impl AsRef<Path>,
        unit: impl Into<Option<Unit>>,
        origin: DVec3,
    ) -> Result<Self, ReadError> {
        Self::read_of(path.as_ref(), ReadTarget::Surface, unit.into(), origin)
    }

    /// As [`read_around`](Self::read_around), for a motion of a [volume](crate::Volume)'s nodes: an error in a file of a
    /// series then names the remedy for a volume.
    ///
    /// # Errors
    /// As [`read_around`](Self::read_around).
    pub fn read_nodes_around(
        path: impl AsRef<Path>,
        unit: impl Into<Option<Unit>>,
        origin: DVec3,
    ) -> Result<Self, ReadError> {
        Self::read_of(path.as_ref(), ReadTarget::Volume, unit.into(), origin)
    }

    fn read_of(
        path: &Path,
        wanted: ReadTarget,
        unit: Option<Unit>,
        origin: DVec3,
    ) -> Result<Self, ReadError> {
        if let Some(series) = series::Series::named(path) {
            return series.read(wanted, unit, origin);
        }
        let place = FileCoordinates { unit: unit.unwrap_or_default(), origin };
        let parse = |bytes: Vec<u8>| match &bytes[..] {
            [] => Err(ReadErrorKind::Empty),
            bytes if bytes.starts_with(pc2::MAGIC) => pc2::parse(bytes, &place),
            bytes if bytes.starts_with(npy::MAGIC) => npy::parse(bytes, &place),
            bytes => Err(unknown(path, bytes)),
        };
        file::whole(path)
            .map_err(ReadErrorKind::from)
            .and_then(parse)
            .map_err(|kind| ReadError { path: path.to_path_buf(), kind })
    }

    /// Converts one frame that is not in a file: positions in `unit` become positions (mm) relative to the mesh's
    /// [origin](crate::Mesh::origin). Errors name the frame by its number.
    ///
    /// ```
    /// use dibs_build::glam::{DVec3, Vec3};
    /// use dibs_build::{Motion, Unit};
    ///
    /// let metres = [[0.25, 0.0, 0.0], [0.5, 0.0, 0.0]];
    /// let frame = Motion::frame_around(&metres, 0, Unit::Metre, DVec3::ZERO)?;
    /// assert_eq!(frame, [Vec3::X * 250.0, Vec3::X * 500.0]);
    /// # Ok::<(), dibs_build::ReadErrorKind>(())
    /// ```
    ///
    /// # Errors
    /// [`ReadErrorKind::NonFinite`] names the first vertex with a coordinate that f32 does not hold. Also for a frame
    /// so far from the origin that f32 does not hold its shape.
    pub fn frame_around(
        positions: &[[f64; 3]],
        number: usize,
        unit: impl Into<Option<Unit>>,
        origin: DVec3,
    ) -> Result<Vec<Vec3>, ReadErrorKind> {
        FileCoordinates { unit: unit.into().unwrap_or_default(), origin }
            .frame_of(positions, number)
    }
}

/// The error for a file that does not begin as a motion: of the reader that its extension names, if any.
fn unknown(path: &Path, bytes: &[u8]) -> ReadErrorKind {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    match extension.to_ascii_lowercase().as_str() {
        "pc2" => ReadErrorKind::NotPc2,
        "npy" => ReadErrorKind::NumPy { what: "it does not begin as a NumPy array".to_owned() },
        "npz" => ReadErrorKind::NumPyArchive,
        _ if bytes.starts_with(b"PK") => ReadErrorKind::NumPyArchive,
        _ => ReadErrorKind::UnknownMotion,
    }
}

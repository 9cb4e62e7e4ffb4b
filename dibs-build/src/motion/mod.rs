//! Recorded motions: one file, PC2 or a NumPy array, or a numbered series of meshes.

mod npy;
mod pc2;
mod series;

pub use pc2::MotionMismatchError;

use crate::read::{ReadError, ReadErrorKind};
use crate::{Motion, Unit};
use std::path::Path;

impl Motion {
    /// Reads a motion: a PC2 file, a NumPy array (.npy) of frames x vertices x 3, or a numbered series of mesh files,
    /// named as `heart_%03d.vtp`. PC2 alone says how many frames a second were recorded.
    ///
    /// # Errors
    /// [`ReadError`], one sentence that names the file, the offending element and the remedy; of a series also where
    /// a number is missing, or a frame has other triangles than the first.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        if let Some(series) = series::Series::named(path) {
            return series.read();
        }
        let parse = |bytes: Vec<u8>| match &bytes[..] {
            [] => Err(ReadErrorKind::Empty),
            bytes if bytes.starts_with(pc2::MAGIC) => pc2::parse(bytes),
            bytes if bytes.starts_with(npy::MAGIC) => npy::parse(bytes),
            _ => Err(ReadErrorKind::UnknownMotion),
        };
        std::fs::read(path)
            .map_err(ReadErrorKind::from)
            .and_then(parse)
            .map_err(|kind| ReadError { path: path.to_path_buf(), kind })
    }

    /// The same motion in millimetres, its lengths being in `unit`.
    #[must_use]
    pub fn in_millimetres(mut self, unit: Unit) -> Self {
        let factor = unit.millimetres();
        for point in self.frames.iter_mut().flatten() {
            *point = (point.as_dvec3() * factor).as_vec3();
        }
        self
    }
}

/// An error at the first coordinate of a frame that is not finite.
fn check_finite(frame: &[glam::Vec3], number: usize) -> Result<(), ReadErrorKind> {
    let Some(vertex) = frame.iter().position(|point| !point.is_finite()) else { return Ok(()) };
    let value = frame[vertex].to_array().into_iter().find(|value| !value.is_finite());
    Err(ReadErrorKind::NonFinite {
        vertex: format!("vertex {vertex} (counted from 0) in frame {number}"),
        value: f64::from(value.unwrap_or(f32::NAN)),
    })
}

//! PC2 point cache files, as animation tools write them.
//!
//! Layout, little-endian: `POINTCACHE2\0`, i32 version 1, i32 points, f32 start frame, f32 sample
//! rate (frames per sample; used here as samples a second, as the field's files do), i32 samples,
//! then samples x points x 3 f32.

use crate::read::{Place, ReadError, ReadErrorKind};
use crate::write::{WriteErrorKind, write_atomically};
use crate::{Mesh, Motion, WriteError};
use glam::{DVec3, Vec3};
use std::path::Path;
use thiserror::Error;

pub(super) const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER: usize = 32;
const POINT: usize = 12;

/// A motion that does not fit a mesh.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MotionMismatchError {
    /// A frame has too few or too many vertices.
    #[error(
        "frame {frame} of the motion has {found} vertices and the mesh has {expected}; use the mesh that the motion was recorded for"
    )]
    Vertices {
        /// The first frame that does not fit, counted from 0.
        frame: usize,
        /// Vertices of the mesh.
        expected: usize,
        /// Vertices of the frame.
        found: usize,
    },
    /// The motion counts from another origin.
    #[error(
        "the motion counts from {found} and the mesh from {expected}; read the motion around the origin of the mesh"
    )]
    Origin {
        /// The mesh's origin.
        expected: DVec3,
        /// The motion's.
        found: DVec3,
    },
}

impl Motion {
    /// Reads a PC2 file of a mesh whose [origin](Mesh::origin) is zero; [`read_around`](Self::read_around) serves others.
    ///
    /// # Errors
    /// [`ReadError`] for a file that is not PC2, is shorter than it claims, or has a coordinate that is not finite.
    pub fn read_pc2(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        std::fs::read(path)
            .map_err(ReadErrorKind::from)
            .and_then(|bytes| parse(&bytes, &Place { scale: 1.0, origin: DVec3::ZERO }))
            .map_err(|kind| ReadError { path: path.to_path_buf(), kind })
    }

    /// Writes a PC2 file.
    ///
    /// # Errors
    /// [`WriteError`], also when frames differ in length, and for an origin that is not zero, since the file's numbers are
    /// of single precision; the file is complete or untouched.
    pub fn write_pc2(&self, path: impl AsRef<Path>) -> Result<(), WriteError> {
        let path = path.as_ref();
        let fail = |kind| WriteError { path: path.to_path_buf(), kind };
        let count = |element, count: usize| {
            i32::try_from(count).map_err(|_| fail(WriteErrorKind::TooMany { element, count }))
        };
        if self.origin != DVec3::ZERO {
            return Err(fail(WriteErrorKind::MotionTooFar));
        }
        let expected = self.frames.first().map_or(0, Vec::len);
        if let Some(frame) = self.frames.iter().position(|frame| frame.len() != expected) {
            let found = self.frames[frame].len();
            return Err(fail(WriteErrorKind::UnevenFrames { frame, expected, found }));
        }
        let points = count("vertices", expected)?;
        let samples = count("frames", self.frames.len())?;
        write_atomically(path, |out| {
            out.write_all(MAGIC)?;
            out.write_all(&1_i32.to_le_bytes())?;
            out.write_all(&points.to_le_bytes())?;
            out.write_all(&0_f32.to_le_bytes())?;
            out.write_all(&self.rate.to_le_bytes())?;
            out.write_all(&samples.to_le_bytes())?;
            for coordinate in self.frames.iter().flatten().flat_map(Vec3::to_array) {
                out.write_all(&coordinate.to_le_bytes())?;
            }
            Ok(())
        })
    }

    /// Checks that every frame has one position for each of the mesh's vertices, from the mesh's origin.
    ///
    /// # Errors
    /// [`MotionMismatchError`] for another origin, or the first frame that does not fit.
    pub fn check_fits(&self, mesh: &Mesh) -> Result<(), MotionMismatchError> {
        if self.origin != mesh.origin {
            let (expected, found) = (mesh.origin, self.origin);
            return Err(MotionMismatchError::Origin { expected, found });
        }
        let expected = mesh.positions.len();
        match self.frames.iter().position(|frame| frame.len() != expected) {
            None => Ok(()),
            Some(frame) => {
                let found = self.frames[frame].len();
                Err(MotionMismatchError::Vertices { frame, expected, found })
            }
        }
    }
}

pub(super) fn parse(bytes: &[u8], place: &Place) -> Result<Motion, ReadErrorKind> {
    if bytes.is_empty() {
        return Err(ReadErrorKind::Empty);
    }
    let (Some(header), true) = (bytes.get(..HEADER), bytes.starts_with(MAGIC)) else {
        return Err(ReadErrorKind::NotPc2);
    };
    let (words, _) = header[MAGIC.len()..].as_chunks::<4>();
    let word = |i: usize| words[i];
    let count = |i: usize| u64::from(u32::from_le_bytes(word(i)));
    let (version, points, samples) = (count(0), count(1), count(4));
    let data = &bytes[HEADER..];
    let frame_bytes = points.saturating_mul(POINT as u64);
    if version != 1 || points == 0 || samples == 0 {
        return Err(ReadErrorKind::NotPc2);
    }
    // The product of the counts is compared with the file's size before it is used.
    if frame_bytes.saturating_mul(samples) != data.len() as u64 {
        return Err(ReadErrorKind::Count {
            element: format!("frames of {points} vertices"),
            claimed: samples,
            found: data.len() as u64 / frame_bytes,
            at_most: false,
        });
    }
    let mut frames = Vec::with_capacity(samples as usize);
    for (number, frame) in data.chunks_exact(frame_bytes as usize).enumerate() {
        let (coordinates, _) = frame.as_chunks::<4>();
        let (points, _) = coordinates.as_chunks::<3>();
        let points: Vec<[f64; 3]> =
            points.iter().map(|p| p.map(|x| f32::from_le_bytes(x).into())).collect();
        frames.push(super::frame(&points, number, place)?);
    }
    let rate = f32::from_le_bytes(word(3));
    let rate = if rate.is_finite() && rate > 0.0 { rate } else { 0.0 };
    Ok(Motion { frames, rate, origin: place.origin })
}

//! PC2 point cache files, as animation tools write them.
//!
//! Layout, little-endian: `POINTCACHE2\0`, i32 version 1, i32 points, f32 start frame, f32 frames per sample, i32
//! samples, then samples x points x 3 f32. The format does not state the frames a second. So this crate's own files
//! append them after the last sample, where other readers do not look: `DIBSRATE`, f32 frames a second.

use crate::frames::{AtRest, check_faces};
use crate::read::{FileCoordinates, ReadError, ReadErrorKind, file};
use crate::write::{WriteErrorKind, write_atomically};
use crate::{FrameError, Mesh, Motion, Unit, WriteError};
use glam::{DVec3, Vec3};
use std::path::Path;
use thiserror::Error;

pub(super) const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER: usize = 32;
const POINT: usize = 12;
const RATE: &[u8; 8] = b"DIBSRATE";
/// Frames per sample: each sample is one frame.
const SAMPLING: f32 = 1.0;

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
    /// A frame has too few or too many nodes.
    #[error(
        "frame {frame} of the motion has {found} points and the volume has {expected} nodes; use the volume that the \
         motion was recorded for"
    )]
    Nodes {
        /// The first frame that does not fit, counted from 0.
        frame: usize,
        /// Nodes of the volume.
        expected: usize,
        /// Points of the frame.
        found: usize,
    },
    /// A frame is far smaller or larger than the mesh, inside out, has other triangles, or an inverted tetrahedron.
    #[error("frame {frame} of the motion: {error}")]
    Frame {
        /// The first such frame, counted from 0.
        frame: usize,
        /// What is wrong with it.
        error: FrameError,
    },
    /// The motion is relative to another origin.
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
    /// Reads a PC2 file of a mesh whose [origin](Mesh::origin) is zero; for others see
    /// [`read_around`](Self::read_around).
    ///
    /// # Errors
    /// [`ReadError`] for a file that is not PC2, is shorter than it claims, or has a coordinate that is not finite.
    pub fn read_pc2(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        file::whole(path)
            .map_err(ReadErrorKind::from)
            .and_then(|bytes| {
                parse(&bytes, &FileCoordinates { unit: Unit::Millimetre, origin: DVec3::ZERO })
            })
            .map_err(|kind| ReadError { path: path.to_path_buf(), kind })
    }

    /// Writes a PC2 file.
    ///
    /// # Errors
    /// [`WriteError`]. Also when frames differ in length, and for an origin that is not zero, since the file's numbers
    /// are of single precision. The file is complete or untouched.
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
            out.write_all(&SAMPLING.to_le_bytes())?;
            out.write_all(&samples.to_le_bytes())?;
            for coordinate in self.frames.iter().flatten().flat_map(Vec3::to_array) {
                out.write_all(&coordinate.to_le_bytes())?;
            }
            if self.rate > 0.0 {
                out.write_all(RATE)?;
                out.write_all(&self.rate.to_le_bytes())?;
            }
            Ok(())
        })
    }

    /// Checks that every frame has one position for each of the mesh's vertices, relative to the mesh's origin, is a
    /// quarter to eight times its size, does not turn a closed surface inside out, and has the mesh's triangles where
    /// its files have faces.
    ///
    /// # Errors
    /// [`MotionMismatchError`] for another origin, or the first frame that does not fit.
    pub fn check_fits(&self, mesh: &Mesh) -> Result<(), MotionMismatchError> {
        self.check_count(mesh)?;
        // Before the shape, so that another numbering is not taken for a surface that is inside out.
        check_faces(&mesh.triangles, mesh.positions.len(), &self.faces)
            .map_err(|error| MotionMismatchError::Frame { frame: 0, error })?;
        self.check_shape(mesh, &AtRest::of_mesh(mesh))
    }

    /// The same of the nodes of a volume with this skeleton: the faces in the files of a volume are its border.
    pub(crate) fn check_fits_nodes(&self, skeleton: &Mesh) -> Result<(), MotionMismatchError> {
        self.check_count(skeleton).map_err(|error| match error {
            MotionMismatchError::Vertices { frame, expected, found } => {
                MotionMismatchError::Nodes { frame, expected, found }
            }
            other => other,
        })?;
        self.check_shape(skeleton, &AtRest::of_skeleton(skeleton))
    }

    fn check_count(&self, mesh: &Mesh) -> Result<(), MotionMismatchError> {
        if self.origin != mesh.origin {
            let (expected, found) = (mesh.origin, self.origin);
            return Err(MotionMismatchError::Origin { expected, found });
        }
        let expected = mesh.positions.len();
        if let Some(frame) = self.frames.iter().position(|frame| frame.len() != expected) {
            let found = self.frames[frame].len();
            return Err(MotionMismatchError::Vertices { frame, expected, found });
        }
        Ok(())
    }

    fn check_shape(&self, mesh: &Mesh, rest: &AtRest) -> Result<(), MotionMismatchError> {
        for (frame, positions) in self.frames.iter().enumerate() {
            rest.check(&mesh.triangles, |vertex| positions.get(vertex as usize).copied())
                .map_err(|error| MotionMismatchError::Frame { frame, error })?;
        }
        Ok(())
    }
}

pub(super) fn parse(bytes: &[u8], place: &FileCoordinates) -> Result<Motion, ReadErrorKind> {
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
    // The product of the counts is compared with the file's size before it is used. A few bytes after the last frame
    // are allowed, but not another frame.
    let length = frame_bytes.saturating_mul(samples);
    let rate = usize::try_from(length).ok().and_then(|length| rate(data.get(length..)?));
    let after = (data.len() as u64).checked_sub(length);
    if rate.is_none() && after.is_none_or(|after| after >= frame_bytes) {
        return Err(ReadErrorKind::Count {
            element: format!("frames of {points} points"),
            claimed: samples,
            found: data.len() as u64 / frame_bytes,
            at_most: false,
        });
    }
    let mut frames = Vec::with_capacity(samples as usize);
    let frames_alone = data.chunks_exact(frame_bytes as usize).take(samples as usize);
    for (number, frame) in frames_alone.enumerate() {
        let (coordinates, _) = frame.as_chunks::<4>();
        let (points, _) = coordinates.as_chunks::<3>();
        let points: Vec<[f64; 3]> =
            points.iter().map(|p| p.map(|x| f32::from_le_bytes(x).into())).collect();
        frames.push(place.frame_of(&points, number)?);
    }
    Ok(Motion { frames, rate: rate.unwrap_or(0.0), origin: place.origin, faces: Vec::new() })
}

/// The frames a second, from the bytes after the last sample.
fn rate(after: &[u8]) -> Option<f32> {
    let rate = after.strip_prefix(RATE)?;
    let rate = f32::from_le_bytes(*rate.as_array()?);
    (rate > 0.0 && rate.is_finite()).then_some(rate)
}

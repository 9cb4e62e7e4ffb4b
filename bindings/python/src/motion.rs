//! Recorded and generated motions, and the stretch that they need.

use std::path::PathBuf;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Import, Motion, Paths};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

use crate::mesh::{Mesh, unit};
use crate::{bytes, error, invalid};

/// The stretch of each triangle of a mesh in a motion.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct MotionStretch(dibs_build::MotionStretch);

#[pymethods]
impl MotionStretch {
    /// Measures frames of as many positions as the mesh has.
    #[new]
    fn new(py: Python<'_>, mesh: &Mesh, frames: &[u8]) -> PyResult<Self> {
        let mesh = &mesh.import.mesh;
        let measured = py.detach(|| {
            let positions = bytes::points(frames);
            let frames = positions.chunks_exact(mesh.positions.len());
            let frames = frames.map(|frame| mesh.local(frame)).collect();
            let motion = Motion { frames, origin: mesh.origin, ..Motion::default() };
            dibs_build::MotionStretch::new(mesh, &motion, Paths::default(), &|_| ())
        });
        measured.map(Self).map_err(invalid)
    }

    fn stretch<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let stretch = self.0.triangles().iter().map(|needed| needed.stretch);
        PyByteArray::new(py, &stretch.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())
    }

    fn frame<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let frames = self.0.triangles().iter().map(|needed| needed.frame as u32);
        PyByteArray::new(py, &frames.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
    }

    fn limits<'py>(&self, py: Python<'py>, margin: f32) -> Bound<'py, PyByteArray> {
        let limits = self.0.limits(margin).into_iter();
        PyByteArray::new(py, &limits.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
    }
}

/// The frames of a motion in the coordinates of its file, their number, and frames a second (0: not stated).
type Frames<'py> = (Bound<'py, PyByteArray>, usize, f32);

/// Reads a motion of a mesh with this origin.
#[pyfunction]
pub fn read_motion<'py>(
    py: Python<'py>,
    path: PathBuf,
    in_unit: Option<&str>,
    origin: [f64; 3],
) -> PyResult<Frames<'py>> {
    let (in_unit, origin) = (in_unit.map(unit).transpose()?, DVec3::from_array(origin));
    let read = py.detach(|| Motion::read_around(path, in_unit, origin));
    let motion = read.map_err(|error| error::read(&error))?;
    Ok(frames(py, &motion.frames, origin, motion.rate))
}

/// A generated heart with its motion, or a brain without one.
#[pyfunction]
pub fn generate<'py>(
    py: Python<'py>,
    kind: &str,
    triangles: u32,
) -> PyResult<(Mesh, Option<Frames<'py>>)> {
    let (mesh, motion) = match kind {
        "heart" => {
            let heart = py.detach(|| dibs_build::generate::heart(triangles)).map_err(invalid)?;
            (heart.mesh, Some(heart.motion))
        }
        "brain" => (py.detach(|| dibs_build::generate::brain(triangles)).map_err(invalid)?, None),
        _ => return Err(invalid(format!("kind is '{kind}'; give 'heart' or 'brain'"))),
    };
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.as_dvec3()).collect();
    let import = Import::options().check(&positions, &mesh.triangles).map_err(invalid)?;
    let motion = motion.map(|motion| frames(py, &motion.frames, mesh.origin, motion.rate));
    Ok((Mesh::new(import, false)?, motion))
}

fn frames<'py>(py: Python<'py>, frames: &[Vec<Vec3>], origin: DVec3, rate: f32) -> Frames<'py> {
    let positions = frames.iter().flatten().map(|position| origin + position.as_dvec3());
    (PyByteArray::new(py, &bytes::of_points(positions)), frames.len(), rate)
}

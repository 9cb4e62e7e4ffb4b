//! A mesh that passed the library's checks.

use std::path::PathBuf;

use dibs_build::glam::DVec3;
use dibs_build::{Builder, Groups, Import, ReadOptions, Report, Unit, Volume, orient};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

use crate::tree::Tree;
use crate::{bytes, error, invalid};

/// A mesh, and the report of its checks.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Mesh {
    pub import: Import,
    turned: Option<usize>,
}

/// `unit`, `weld`, `strict`, `largest_component`, `origin`, `orient`, `groups`.
type Reading = (Option<String>, Option<f32>, bool, bool, Option<[f64; 3]>, bool, bool);

#[pymethods]
impl Mesh {
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, reading: Reading) -> PyResult<Self> {
        let (options, is_to_turn) = options(reading)?;
        let import = py.detach(|| options.read(path)).map_err(|error| error::read(&error))?;
        Self::new(import, is_to_turn)
    }

    #[staticmethod]
    fn of(py: Python<'_>, positions: &[u8], triangles: &[u8], reading: Reading) -> PyResult<Self> {
        let (options, is_to_turn) = options(reading)?;
        let check = || options.check(&bytes::points(positions), &bytes::cells(triangles));
        Self::new(py.detach(check).map_err(invalid)?, is_to_turn)
    }

    /// Restores a mesh from the results of another mesh's methods, in this process or another.
    #[staticmethod]
    fn restored(
        positions: &[u8],
        triangles: &[u8],
        report: &str,
        groups: Option<(Vec<u8>, String)>,
        faces: &[u8],
        turned: Option<usize>,
    ) -> PyResult<Self> {
        let report: Report = serde_json::from_str(report).map_err(invalid)?;
        let mut mesh = dibs_build::Mesh {
            origin: DVec3::from_array(report.origin),
            triangles: bytes::cells(triangles),
            ..dibs_build::Mesh::default()
        };
        mesh.positions = mesh.local(&bytes::points(positions));
        let groups = groups.map(|(labels, groups)| {
            serde_json::from_str(&groups).map(|groups| Groups { labels, groups })
        });
        let groups = groups.transpose().map_err(invalid)?;
        let faces = bytes::cells(faces).into_iter().map(|[face]| face).collect();
        Ok(Self { import: Import { mesh, report, groups, faces }, turned })
    }

    /// Positions in the coordinates of the file.
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let mesh = &self.import.mesh;
        let positions = mesh.positions.iter().map(|position| mesh.origin + position.as_dvec3());
        PyByteArray::new(py, &bytes::of_points(positions))
    }

    fn triangles<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let corners = self.import.mesh.triangles.iter().flatten();
        let bytes: Vec<u8> = corners.flat_map(|corner| corner.to_le_bytes()).collect();
        PyByteArray::new(py, &bytes)
    }

    fn origin(&self) -> [f64; 3] {
        self.import.mesh.origin.to_array()
    }

    /// The report in JSON.
    fn report(&self) -> PyResult<String> {
        serde_json::to_string(&self.import.report).map_err(invalid)
    }

    /// The labels of the file's groups, and the groups in JSON, if they were requested.
    fn groups<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyByteArray>, String)>> {
        let Some(groups) = &self.import.groups else { return Ok(None) };
        let named = serde_json::to_string(&groups.groups).map_err(invalid)?;
        Ok(Some((PyByteArray::new(py, &groups.labels), named)))
    }

    /// The face of the file that each triangle comes from.
    fn faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let faces = self.import.faces.iter();
        PyByteArray::new(py, &faces.flat_map(|face| face.to_le_bytes()).collect::<Vec<u8>>())
    }

    fn turned(&self) -> Option<usize> {
        self.turned
    }

    fn warnings(&self) -> Vec<String> {
        let warnings = self.import.report.warnings().chain(self.import.mesh.warnings());
        warnings.map(error::sentence).collect()
    }

    fn build(
        &self,
        py: Python<'_>,
        stretch: f32,
        limits: Option<&[u8]>,
        labels: Option<&[u8]>,
        volume: Option<(&[u8], &[u8], f64)>,
    ) -> PyResult<Tree> {
        let builder = match limits {
            Some(limits) => Builder::new().limits(bytes::floats(limits)),
            None => Builder::new().stretch(stretch),
        };
        let builder = match labels {
            Some(labels) => builder.labels(labels.to_vec()),
            None => builder,
        };
        let volume = volume.map(|(nodes, tetrahedra, within)| {
            let volume = Volume::new(bytes::points(nodes), bytes::cells(tetrahedra));
            volume.map(|volume| volume.bind_within(within))
        });
        let builder = match volume.transpose().map_err(invalid)? {
            Some(volume) => builder.nodes(&volume),
            None => builder,
        };
        let built = py.detach(|| builder.build(&self.import));
        Tree::from_blob(built.map_err(|error| error::build(&error))?.blob().to_vec())
    }
}

impl Mesh {
    /// A mesh, with its triangles flipped outwards if requested.
    pub fn new(mut import: Import, is_to_turn: bool) -> PyResult<Self> {
        let turned =
            if is_to_turn { Some(orient(&mut import.mesh).map_err(invalid)?) } else { None };
        Ok(Self { import, turned })
    }
}

/// The reading options, and whether to flip the mesh outwards.
fn options(reading: Reading) -> PyResult<(ReadOptions, bool)> {
    let (unit, weld_tolerance, strict, largest_component, origin, is_to_turn, groups) = reading;
    let unit = unit.as_deref().map(self::unit).transpose()?;
    let origin = origin.map(DVec3::from_array);
    let options = ReadOptions { weld_tolerance, strict, largest_component, unit, origin, groups };
    Ok((options, is_to_turn))
}

/// A unit by its name on the command line.
pub fn unit(name: &str) -> PyResult<Unit> {
    let unit = Unit::ALL.into_iter().find(|unit| unit.symbol() == name);
    let wrong = || invalid(format!("unit is '{name}'; give 'mm', 'cm', 'm', 'in' or 'um'"));
    unit.ok_or_else(wrong)
}

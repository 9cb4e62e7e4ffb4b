//! Files as other programs write them, written anew here: one tetrahedron in the dialects of each format, and each
//! element that is left out or refused by its name.

mod gltf;
mod gmsh;
mod motion;
mod package;
mod text;
mod vtk;

use std::path::{Path, PathBuf};

use dibs_build::glam::Vec3;
use dibs_build::{Import, ReadOptions};

/// The corners of a tetrahedron, and its faces from outside.
pub const POINTS: [[f32; 3]; 4] = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 6.0]];
pub const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Import {
        let path = self.put(name, bytes);
        dibs_build::read(path).unwrap_or_else(|error| panic!("{error}"))
    }

    /// With labels of its groups.
    pub fn read_labels(&self, name: &str, bytes: impl AsRef<[u8]>) -> Import {
        let options = ReadOptions { groups: true, ..Import::options() };
        let path = self.put(name, bytes);
        options.read(path).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The sentence of a file that is refused.
    pub fn says(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let message = dibs_build::read(self.put(name, bytes)).unwrap_err().kind.to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        message
    }
}

/// Triangles that begin with their least corner, sorted.
pub fn sorted(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let turned = |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let mut triangles: Vec<_> = triangles.iter().filter_map(turned).collect();
    triangles.sort_unstable();
    triangles
}

/// The tetrahedron, its positions times `scale`.
pub fn is_tetrahedron(import: &Import, scale: f64, name: &str) {
    let scaled = |point: [f32; 3]| Vec3::from(point.map(|x| (f64::from(x) * scale) as f32));
    let positions = POINTS.map(scaled);
    assert_eq!(import.mesh.positions, positions, "{name}");
    assert_eq!(sorted(&import.mesh.triangles), sorted(&FACES), "{name}");
}

pub fn warnings(import: &Import) -> Vec<String> {
    import.report.warnings().collect()
}

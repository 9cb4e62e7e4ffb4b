//! The surface in its rest shape: positions and triangles.

use dibs_nostd::format::Unit;
use glam::{DVec3, Vec3};

/// A triangle mesh: fixed connectivity, and the positions of one frame.
///
/// Coordinates are in millimetres, and f32 as on the controller: geodesics computed on
/// more precise coordinates would not bound the controller's distances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The point of the mesh's file, in millimetres, that positions are relative to. It is zero unless the file's
    /// coordinates are so far from their own origin that f32 would lose the shape. A tree stores it.
    pub origin: DVec3,
    /// One position a vertex.
    pub positions: Vec<Vec3>,
    /// Three vertex numbers a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Converts positions in the file's coordinates (mm) to this mesh's: relative to its [origin](Mesh::origin), then
    /// rounded to f32.
    #[must_use]
    pub fn local(&self, positions: &[DVec3]) -> Vec<Vec3> {
        positions.iter().map(|&position| (position - self.origin).as_vec3()).collect()
    }

    /// Positions of a triangle's corners.
    pub(crate) fn corners(&self, vertices: [u32; 3]) -> [Vec3; 3] {
        vertices.map(|vertex| self.positions[vertex as usize])
    }
}

/// A surface that a tree can be built on: a [`Mesh`], or an [`Import`](crate::Import).
pub trait RestSurface {
    /// Its positions and triangles.
    fn mesh(&self) -> &Mesh;

    /// Largest error of a vertex position (mm, not negative).
    fn position_error(&self) -> f32;

    /// The unit of its file, whose lengths were converted to millimetres; `None` if it has no file.
    fn unit(&self) -> Option<Unit> {
        None
    }

    /// Triangles of its file, including those that were dropped.
    fn file_triangles(&self) -> usize {
        self.mesh().triangles.len()
    }

    /// The face of its file, counted from 0, that each triangle comes from, and the number of faces in the file; `None`
    /// if it has no file.
    fn file_faces(&self) -> Option<(&[u32], usize)> {
        None
    }
}

impl RestSurface for Mesh {
    fn mesh(&self) -> &Mesh {
        self
    }

    fn position_error(&self) -> f32 {
        0.0
    }
}

impl<S: RestSurface> RestSurface for &S {
    fn mesh(&self) -> &Mesh {
        (**self).mesh()
    }

    fn position_error(&self) -> f32 {
        (**self).position_error()
    }

    fn unit(&self) -> Option<Unit> {
        (**self).unit()
    }

    fn file_triangles(&self) -> usize {
        (**self).file_triangles()
    }

    fn file_faces(&self) -> Option<(&[u32], usize)> {
        (**self).file_faces()
    }
}

/// A recorded or generated deformation of a mesh: every frame holds one position a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// The frames, in order of time. Positions are relative to the origin.
    pub frames: Vec<Vec<Vec3>>,
    /// Frames a second; 0 if the file does not state it.
    pub rate: f32,
    /// The [origin](Mesh::origin) of the mesh.
    pub origin: DVec3,
    /// The faces that all files of a series have, by the vertices of each; empty for other motions.
    pub faces: Vec<Vec<u32>>,
}

//! The surface in its rest shape: positions and triangles.

use glam::Vec3;

/// A triangle mesh: fixed connectivity, and the positions of one frame.
///
/// Coordinates are in the mesh's own unit (mm in the examples), and f32 as on the controller: geodesics on other
/// numbers would not bound its distances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// One position a vertex.
    pub positions: Vec<Vec3>,
    /// Three vertex numbers a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Positions of a triangle's corners.
    pub(crate) fn corners(&self, vertices: [u32; 3]) -> [Vec3; 3] {
        vertices.map(|vertex| self.positions[vertex as usize])
    }
}

/// A surface that a tree can be built on: a [`Mesh`], or an [`Import`](crate::Import).
pub trait RestSurface {
    /// Its positions and triangles.
    fn mesh(&self) -> &Mesh;

    /// Largest error of a vertex (in the mesh's unit, not negative).
    fn position_error(&self) -> f32;
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
}

/// A recorded or generated deformation of a mesh: every frame holds one position a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// The frames, in order of time.
    pub frames: Vec<Vec<Vec3>>,
    /// Frames a second; 0 if the file does not state it.
    pub rate: f32,
}

//! The benchmark's interface to all methods, this library's and others'.

use std::ops::{Add, Mul, Sub};

use dibs_nostd::{Capsule, Sphere};
use glam::Vec3;

/// A tool, as passed to every method.
#[derive(Clone, Copy, Debug)]
pub enum Probe {
    /// A sphere.
    Sphere(Sphere),
    /// A capsule.
    Capsule(Capsule),
}

/// A method's answer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Distance from the tool's surface to the mesh; 0 if they touch or overlap.
    pub separation: f32,
    /// Tests of bounding volumes and of triangles; `None` if the method does not count them.
    pub tests: Option<[u32; 2]>,
}

/// A method for closest-point queries on a surface that deforms.
///
/// A step is `load`, `update`, then any number of `find`; the same frame may be loaded again between two of them. All
/// methods are single-threaded.
pub trait Method {
    /// Copies the frame's positions (in the mesh's order) to the method's order and layout. Not timed, because every
    /// method needs its vertices written.
    fn load(&mut self, positions: &[Vec3]);

    /// All work of a frame before its first query.
    fn update(&mut self);

    /// The closest pair between the tool and the current surface.
    fn find(&mut self, tool: &Probe) -> Found;
}

/// A method whose positions others may write, in the method's own order and layout.
pub trait Layout: Method {
    /// A position as the method stores it.
    type Position: Copy
        + Add<Output = Self::Position>
        + Sub<Output = Self::Position>
        + Mul<f32, Output = Self::Position>;

    /// The positions that were loaded last. A change is used from the next `update` on.
    fn positions_mut(&mut self) -> &mut [Self::Position];

    /// The mesh vertex of a row.
    fn vertex(&self, row: usize) -> u32;
}

//! The benchmark's interface to every method, ours and others'.

use dibs_nostd::{Capsule, Sphere};
use glam::Vec3;

/// A tool, as every method gets it.
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
    /// Distance from the tool's surface to the mesh; 0 where they touch or overlap.
    pub separation: f32,
    /// Bounding volumes tested, and triangles; `None` where the method does not tell.
    pub tests: Option<[u32; 2]>,
}

/// A way to answer closest-point queries on a surface that deforms.
///
/// A step is `load`, `update`, then any number of `find`; the same frame may be loaded again before a
/// `find`. All methods are single-threaded.
pub trait Method {
    /// Takes the frame's positions (in the mesh's order) into the method's own order and layout. Not
    /// timed: every method's vertices are written by somebody.
    fn load(&mut self, positions: &[Vec3]);

    /// Everything that must be done once a frame before the first query.
    fn update(&mut self);

    /// The closest pair between the tool and the surface as it is now.
    fn find(&mut self, tool: &Probe) -> Found;
}

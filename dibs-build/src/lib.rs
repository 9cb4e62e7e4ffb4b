//! From a mesh file to a static deformation invariant bounding sphere tree.

mod mesh;

pub use mesh::{Mesh, Motion};

//! Today's alternative libraries.

mod obvhs;
mod parry_bvh;
mod parry_trimesh;

pub use obvhs::Obvhs;
pub use parry_bvh::ParryBvh;
pub use parry_trimesh::ParryTriMesh;

//! Volumes of tetrahedra whose nodes move a surface: [`Builder::nodes`](crate::Builder::nodes).

// Requirement: F-07

mod binding;
mod encode;
mod paths;
mod volume;

pub(crate) use binding::Embedding;
pub(crate) use encode::{encode, least_limit, least_stretch_limit, own_limit};
pub(crate) use paths::VolumePaths;
pub use volume::{Volume, VolumeError};
pub(crate) use volume::{edges, largest_stretch};

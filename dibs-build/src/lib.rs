//! From a mesh file to a static deformation invariant bounding sphere tree, for `dibs-nostd`.
//!
//! The `main` of a `build.rs`:
//!
//! ```no_run
//! dibs_build::tree("heart.ply").stretch(1.5).emit("heart");
//! ```
//!
//! The program then says `dibs_nostd::include_tree!("heart")`. [`tree`] is made of parts: [`read`] imports and checks a
//! mesh, [`Builder`] makes the tree, and [`BuiltTree`] is written as a Rust module or as a blob. [`Motion`] is a
//! recorded deformation, [`modes`] approximates it by a few weights, and `generate` makes procedural hearts and brains.
//! The library prints nothing; the program `dibs` of the crate `dibs-cli` does.

mod array;
mod builder;
mod components;
mod construct;
mod crossing;
mod error;
mod export;
mod faces;
mod frame_file;
mod frames;
#[cfg(feature = "generate")]
pub mod generate;
mod geodesic;
mod labels;
mod leaf;
mod mesh;
#[cfg(feature = "modes")]
pub mod modes;
mod motion;
mod nodes;
mod orient;
mod parts;
mod read;
mod rest;
mod rounding;
mod script;
mod stretch;
mod surface_rows;
mod volume_file;
mod warnings;
mod write;

pub use array::{BuiltTree, ModesSummary, Summary, VolumeSummary, summarise};
pub use builder::{Builder, IndexWidth};
pub use construct::Construction;
pub use error::BuildError;
pub use frames::{FrameCheck, FrameError};
pub use labels::{LabelsError, LabelsErrorKind, read_labels};
pub use mesh::{Mesh, Motion, RestSurface};
pub use motion::MotionMismatchError;
pub use nodes::{Volume, VolumeError};
pub use orient::{WindingError, check_winding, orient};
pub use parts::files_of;
pub use read::{
    Format, Group, Groups, Import, ReadError, ReadErrorKind, ReadOptions, Report, read,
};
pub use rest::Paths;
pub use script::{MeshSource, TreeScript, tree};
pub use stretch::{
    LimitExcess, LimitsError, LimitsErrorKind, MotionStretch, PeakStretch, largest_stretch,
    read_limits, write_limits,
};
pub use surface_rows::SurfaceRows;
pub use write::{WriteError, WriteErrorKind, write_atomically};

pub use dibs_nostd::format::Unit;
/// The vector types in this interface.
pub use glam;

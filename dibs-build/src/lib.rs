//! From a mesh file to a static deformation invariant bounding sphere tree.

mod builder;
mod check;
mod construct;
mod emit;
mod error;
mod flatten;
pub mod generate;
mod geodesic;
mod graph;
mod mesh;
mod paper;
mod pc2;
mod pin;
mod read;
mod section;
mod split;
mod topology;
mod weld;
mod write;

pub use builder::{Builder, Construction, IndexWidth};
pub use emit::{BuiltTree, Summary, summarise};
pub use error::BuildError;
pub use graph::Paths;
pub use mesh::{Mesh, Motion};
pub use pc2::MotionMismatch;
pub use read::{Format, Import, ReadError, ReadErrorKind, ReadOptions, Report, read};
pub use write::{WriteError, WriteErrorKind, write_atomically};

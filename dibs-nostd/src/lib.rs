//! Proximity queries on a deforming mesh, for hard real-time controllers.
#![no_std]
#![deny(unsafe_code)]

pub use glam;

mod answer;
mod assembler;
mod check;
pub mod constraint;
pub mod format;
mod frames;
mod index;
mod query;
mod sqrt;
mod stretch;
mod tool;
mod tree;
mod vertices;
pub mod wire;

pub use answer::Proximity;
pub use assembler::{Assembler, Counters, Gate, Progress, Rejection, Unchecked};
pub use check::FormatError;
pub use frames::{
    FrameGuard, FrameLabel, FrameReader, FrameView, FrameWriter, Frames, OutOfTable, PublishError,
};
pub use index::Index;
pub use query::{Budget, Options, Query, QueryError};
pub use stretch::{MeasuredStretch, StretchError, measure_stretch};
pub use tool::{ACCURACY, AxisPair, Capsule, MAX_COORDINATE, Sphere, Tool, ToolError};
pub use tree::Tree;
pub use vertices::{QuantisedVertices, VertexTable};

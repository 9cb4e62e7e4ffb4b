//! The surface as it is now: vertex tables, and the double buffer that frames arrive in.

mod atomic;
pub(crate) mod frames;
mod vertices;

pub use frames::{
    FrameGuard, FrameLabel, FrameReader, FrameView, FrameWriter, Frames, OutOfTable, PublishError,
};
pub use vertices::{QuantisedVertices, VertexTable};

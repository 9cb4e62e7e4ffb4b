//! The surface as it is now: vertex tables, and the double buffer that frames arrive in.

mod atomic;
mod frames;
mod measured;
pub(crate) mod motion;
mod moving;
mod vertices;

pub use frames::{
    FrameGuard, FrameLabel, FrameReader, FrameView, FrameWriter, Frames, OutOfTable, PublishError,
};
pub(crate) use measured::share;
pub use measured::{MeasuredStretch, REGIONS};
pub use motion::{Moved, MovingSurface, Odometer, Travel};
pub use moving::{Between, Step};
pub use vertices::{QuantisedVertices, VertexTable};

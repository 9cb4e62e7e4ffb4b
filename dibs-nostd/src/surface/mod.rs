//! The surface as it is now: vertex tables, and the double buffer that frames arrive in.

mod age;
mod atomic;
mod frames;
mod latest;
mod measured;
pub(crate) mod motion;
mod moving;
mod vertices;

pub(crate) use age::Ageing;
pub use frames::{
    FrameGuard, FrameLabel, FrameReader, FrameView, FrameWriter, Frames, OutOfTable, PublishError,
};
pub use latest::{FrameAge, Latest};
pub(crate) use measured::share;
pub use measured::{MeasuredStretch, REGIONS};
pub use motion::{Moved, MovingSurface, Odometer, Travel};
pub use moving::{Between, Step};
pub use vertices::{QuantisedVertices, VertexTable};

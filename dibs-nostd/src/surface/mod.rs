//! The current surface: vertex tables, and the double buffer in which frames arrive.

// Requirement: F-09

mod atomic;
mod buffer;
mod error;
mod frames;
mod latest;
mod measured;
pub(crate) mod motion;
mod moving;
#[cfg(feature = "bus")]
mod pose;
mod prediction;
mod reader;
mod vertices;

pub(crate) use crate::time::StampAge;
#[cfg(feature = "bus")]
pub(crate) use crate::time::{AHEAD, elapsed};
pub use crate::time::{Millis, Ticks};
#[cfg(all(feature = "bus", feature = "control"))]
pub(crate) use atomic::{AtomicU32, Ordering};
#[cfg(any(feature = "bus", feature = "modes"))]
pub(crate) use buffer::PredictionCheck;
pub use buffer::{Buffer, FrameLabel, Head, Position};
pub use error::{OutOfTableError, PublishError, SplitError};
pub use frames::{Buffers, FrameWriter, Frames};
pub use latest::{FrameAge, LatestSurface};
pub(crate) use measured::region_sigma;
pub use measured::{Coverage, MeasuredStretch, REGIONS};
pub use motion::{MotionReading, MotionUnit, MovingSurface, MovingTable, Odometer};
#[cfg(any(feature = "modes", all(feature = "bus", feature = "control")))]
pub(crate) use moving::{FARTHEST, clamped, grown};
pub use moving::{Step, SurfaceBlend};
#[cfg(all(feature = "bus", feature = "control"))]
pub(crate) use pose::PoseStep;
#[cfg(feature = "bus")]
pub use pose::{PoseError, RigidPose};
#[cfg(feature = "modes")]
pub(crate) use prediction::Prediction;
#[cfg(feature = "bus")]
pub(crate) use reader::LastStep;
pub use reader::{FrameGuard, FrameReader, FrameView};
pub use vertices::{QuantisedVertices, VertexTable};

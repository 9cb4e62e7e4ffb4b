//! The closest pair of points between an instrument and a deforming mesh, for hard real-time
//! controllers.
//!
//! Deformation invariant bounding spheres (Bowyer & Rodriguez y Baena, Proc IMechE Part H 228(4), 2014): each sphere of
//! a [`Tree`] is pinned to a mesh vertex, and its radius is the largest distance along the surface to the vertices
//! below it, times a stretch limit. When the vertices move, the tree stays valid without a change, so it can be stored
//! in flash.
//!
//! `no_std`, no allocation, no panic, no recursion, no unbounded loop. `unsafe` only for the hardware
//! square root. The same bits on host and target.
//!
//! # From vertices to a force
//!
//! | step | type | context |
//! |---|---|---|
//! | bytes become packets | [`wire::Deframer`] | bus interrupt |
//! | packets become complete, checked frames | [`Assembler`], [`StretchMonitor`] | bus interrupt |
//! | frames are handed over, never torn | [`Frames`] | both |
//! | a frame is searched | [`Query`], [`Sphere`], [`Capsule`] | control interrupt |
//! | the answer and its certainty | [`Proximity`] | control interrupt |
//! | whether the surface may be trusted | [`failsafe`] | control interrupt |
//! | the force | [`constraint`] | control interrupt |
//! | or the motion that a command may make | [`filter`] | control interrupt |
//!
//! Lengths are in millimetres: the builder converts a mesh's. Trees come from the crate `dibs-build`.
//!
//! ```
//! use dibs_build::{Builder, generate};
//! use dibs_nostd::{Capsule, Options, Query, Tree, measure_stretch, glam::Vec3};
//!
//! // On a host: a tree, as a build script writes it into a static.
//! let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
//! let built = Builder::new().stretch(1.5).build(&heart)?;
//!
//! // On the target: the tree's bytes, validated once, and a query with a fixed stack.
//! let tree = Tree::<u16>::from_bytes(built.blob())?;
//! let mut query = Query::<_, 32>::new(&tree)?;
//!
//! // At each tick: the current vertices, in the tree's order.
//! let vertices = built.to_rows(&motion.frames[9]);
//! let tool = Capsule::new(Vec3::new(70.0, 0.0, 20.0), Vec3::new(120.0, 0.0, 60.0), 2.5)?;
//! let measured = measure_stretch(&tree, vertices.as_slice())?;
//! let closest = query.closest(vertices.as_slice(), &tool, &Options::new().stretch(measured))?;
//! assert!(closest.lower == closest.separation && closest.accuracy < 0.001);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! - `bus`, `control`, `modes`, `nodes`, on by default: packets and the [`Assembler`]; [`constraint`], [`filter`] and
//!   [`failsafe`]; [`modes`]; [`nodes`].
//! - `batched`: `Query::closest_batched`, which tests several subtrees at once, for large processors.
//! - `defmt`: `defmt::Format` for every public value and error.
//! - `serde`: `Serialize` for answers, limits and states; `Deserialize` for [`Budget`], [`Cost`], [`SurfaceLimits`] and times,
//!   which are checked when used. Other limits are made by calls that check them.
//! - `mint`: points of other mathematics crates convert to `glam`'s, so that `Bus::frame` takes them.
//! - `embedded-io`: `guard`'s `Bus` on any byte stream.
//! - `embedded-can`: packets as frames of a driver for CAN-FD ([`wire::canfd`]).
//! - `portable-atomic`: for processors without compare-and-swap; interrupts are masked for the few instructions of each
//!   publication and read of a frame, by the program's `critical-section` implementation.
//! - `authenticity`: [`wire`]'s `AesCmac`, with which a receiver accepts only packets with a genuine tag.

// Requirement: P-01

#![no_std]
#![deny(unsafe_code)]

pub use glam;

#[macro_use]
mod math;

#[cfg(feature = "control")]
mod control;
mod error;
#[cfg(all(feature = "bus", feature = "control"))]
pub mod guard;
mod include;
#[cfg(feature = "modes")]
pub mod modes;
#[cfg(feature = "nodes")]
pub mod nodes;
mod query;
#[cfg(feature = "bus")]
mod receive;
mod stretch;
mod surface;
mod time;
mod tool;
mod tree;
mod unavailable;
#[cfg(feature = "bus")]
pub mod wire;

#[cfg(feature = "control")]
pub use control::{constraint, failsafe, filter};
pub use error::Error;
pub use query::{
    Budget, Closest, Contact, ContactIter, Contacts, Cost, Fallback, Interval, NoSide, Options,
    Proximity, Query, Side, Sweep, SweepAnswer, Tracker, TrackerAnswer,
};
#[cfg(feature = "bus")]
pub use receive::{Advance, Assembler, BusHealth, LastHeartbeat, Progress, ReceiveError};
#[doc(hidden)]
pub use stretch::Comparison;
pub use stretch::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, NoAdmissionCheck, StretchError,
    StretchMonitor, SurfaceLimits, measure_stretch,
};
#[doc(hidden)]
pub use surface::REGIONS;
/// Surfaces of a size that no type has, for the C interface. They may change with any version.
#[doc(hidden)]
pub use surface::{Buffer, Buffers, Head, Position};
pub use surface::{
    Coverage, FrameAge, FrameGuard, FrameLabel, FrameReader, FrameView, FrameWriter, Frames,
    LatestSurface, MeasuredStretch, Millis, MotionReading, MovingSurface, MovingTable, Odometer,
    OutOfTableError, PublishError, QuantisedVertices, SplitError, Step, SurfaceBlend, Ticks,
    VertexTable,
};
#[cfg(feature = "bus")]
pub use surface::{PoseError, RigidPose};
#[doc(hidden)]
pub use tool::{ACCURACY, MAX_COORDINATE};
pub use tool::{AxisPair, Capsule, Sphere, Tool, ToolError};
pub use tree::{
    CorruptTreeError, FormatError, Index, PathKind, Scrub, Tree, TreeBytes, TriangleRow,
    VertexNumber,
};
/// The layout of a tree's bytes, for `dibs-build`. It may change with any version.
#[doc(hidden)]
pub use tree::{SurfaceFacts, format};
pub use unavailable::{QueryError, Unavailable};

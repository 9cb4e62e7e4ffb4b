//! A controller's two ends of a moving surface: [`Bus`] takes packets, [`Guard`] answers the control tick.
//!
//! They combine the layers of this crate as most controllers need them, and derive what the library can: the reach, the
//! stretch, the age, the extrapolation and its error, the fail-safe state, the last side, the velocities. Every layer
//! stays public, for other combinations.
//!
//! ```
//! use dibs_build::{Builder, generate};
//! use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
//! use dibs_nostd::{Capsule, Millis, TreeBytes, Unavailable, glam::Vec3};
//! use dibs_nostd::guard::{GuardLimits, Surface};
//!
//! # let heart = generate::heart(320)?.mesh;
//! # let built = Builder::new().stretch(1.5).build(&heart)?;
//! # let tree = TreeBytes::<u16>::new(built.blob());
//! # let (bytes, now) = ([0; 16], Millis(0));
//! static HEART: Surface<162> = Surface::new(); // with `include_tree!`: `heart::Surface`
//!
//! let limits = GuardLimits::new(300.0, Millis(80)); // tissue below 300 mm/s, surfaces younger than 80 ms
//! let (mut bus, mut guard) = HEART.start::<_, 32, 64>(tree, limits)?; // `heart::start(&HEART, limits)?`
//! let wall = ForbiddenRegion::new(SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0), 5.0)?;
//!
//! // Bus interrupt, or a thread: bytes of a line, or packets of a network; then slices of the checks.
//! bus.receive(&bytes, now);
//! bus.work(100);
//! # let mut line = [0; dibs_nostd::guard::Bus::<u16>::STATUS_FRAMED];
//! let _to_send = bus.status_framed(now, &mut line); // its echo measures the transit: unknown, it is unsafe
//!
//! // Control interrupt, of higher priority.
//! let tool = Capsule::new(Vec3::new(0.0, 0.0, 90.0), Vec3::new(0.0, 0.0, 150.0), 2.5)?;
//! let force = guard.closest(&tool, now).force(&wall);
//! assert_eq!(force.state, ConstraintState::Safe(Unavailable::NoSurface));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Requirement: C-07

mod answer;
mod bus;
mod limits;
#[cfg(feature = "embedded-io")]
mod line;
mod pose_admission;
mod posed;
mod poses;
mod rows;
mod surface;
mod tick;

pub use answer::{Answer, SearchedSurface};
pub use bus::Bus;
pub use limits::GuardLimits;
pub use posed::PosedRows;
/// For the model checker and the fault matrix. They may change with any version.
#[doc(hidden)]
pub use poses::Poses;
#[doc(hidden)]
pub use rows::SharedState;
/// The kinds of rows, for [`Bus`], [`Guard`] and [`Surface`].
#[doc(hidden)]
pub use rows::{Rows, Vertices};
/// For the C interface. They may change with any version.
#[doc(hidden)]
pub use surface::Notes;
pub use surface::Surface;
pub use tick::Guard;

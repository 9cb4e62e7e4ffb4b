//! The imaging side: sends a moving surface to a controller, over a serial line or a socket.
//!
//! ```no_run
//! use dibs_stream::{Sender, Settings, SurfaceOrder};
//! use dibs_stream::transport::Target;
//! # let dibs_build::generate::MovingMesh { mesh: heart, motion } = dibs_build::generate::heart(500)?;
//! # let built = dibs_build::Builder::new().build(&heart)?;
//!
//! let target: Target = "serial:/dev/ttyUSB0@921600".parse()?;
//! let order = SurfaceOrder::of(&built.tree::<u16>()?);
//! let settings = Settings { partial: Some(0.05), ..Settings::default() };
//! let mut sender = Sender::<_, 1024>::new(target.open()?, order, settings);
//! for positions in &motion.frames {
//!     let sent = sender.send(positions)?;
//!     sender.poll()?;
//!     println!("frame {} in {} bytes, {:?}", sent.epoch, sent.bytes, sender.status());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The bytes are specified in `dibs-nostd`'s `docs/wire.md`; [`transport`] carries them, and
//! [`faults`] damages them, for tests.

pub mod faults;
mod pace;
mod sender;
pub mod transport;

pub use pace::Pace;
pub use sender::{PreparedFrame, SendError, Sender, SentFrame, Settings, SurfaceOrder, Totals};

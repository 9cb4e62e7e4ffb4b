//! The viewer's session: a tree, a motion and an instrument, behind the page that `dibs view` writes.
//!
//! The page draws and listens. Every number that it shows comes from `dibs-nostd`, through this crate, compiled to
//! WebAssembly; natively the same code serves tests.

mod contacts;
mod error;
mod instrument;
mod motion;
#[cfg(target_arch = "wasm32")]
mod page;
mod session;
mod spheres;

pub use contacts::ContactMarks;
pub use error::SessionError;
pub use instrument::Instrument;
pub use motion::{Interpolation, Motion};
pub use session::{Counts, Search, Session, Settings, open};

//! The imaging side: sends a moving surface to a controller, over a serial line or a socket.
mod target;
mod transport;
pub use target::{Target, TargetError};
pub use transport::{Line, Transport};

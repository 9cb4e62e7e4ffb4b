//! The bus: packets, and the frames that are assembled from them.

pub(crate) mod assembler;
pub mod wire;

pub use assembler::{Advance, Assembler, BusHealth, LastHeartbeat, Progress, ReceiveError};

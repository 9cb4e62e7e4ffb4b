//! The bus: packets, and the frames that are assembled from them.

pub(crate) mod assembler;
pub mod wire;

pub use assembler::{
    Advance, Assembler, Changed, Gate, LastHeartbeat, Progress, Rejection, Unchecked, Verdict,
};

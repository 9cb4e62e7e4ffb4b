//! Arithmetic that gives the same bits on host and target.

pub(crate) mod four;
pub(crate) mod sqrt;

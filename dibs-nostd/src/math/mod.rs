//! Arithmetic that gives the same bits on host and target.

pub(crate) mod round;
pub(crate) mod sqrt;
pub(crate) mod vec3x4;

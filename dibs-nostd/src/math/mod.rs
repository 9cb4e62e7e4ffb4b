//! Arithmetic that gives the same bits on host and target.

// Requirement: A-11

#[cfg(feature = "serde")]
pub(crate) mod no_limit;
pub(crate) mod order;
pub(crate) mod round;
pub(crate) mod sqrt;
pub(crate) mod vec3x4;

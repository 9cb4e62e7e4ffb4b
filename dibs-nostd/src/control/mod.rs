//! From an answer to a force: constraints, and whether the surface may be trusted.

pub mod constraint;
pub mod failsafe;

//! From an answer to an output: forces, admitted motions, and whether the surface may be trusted.

pub mod constraint;
pub mod failsafe;
pub mod filter;

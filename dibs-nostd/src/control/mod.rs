//! From an answer to an output: forces, admitted motions, and whether the surface may be trusted.

// Requirements: C-01, C-02, C-05

pub mod constraint;
pub mod failsafe;
pub mod filter;

//! Shared by the tests.

pub mod ask;
pub mod baselines;
pub mod bus;
pub mod deform;
pub mod dibs;
pub mod method;
pub mod motions;
pub mod oracle;
pub mod poses;
pub mod streams;
pub mod stretch;
pub mod surfaces;

/// The README's code: it compiles, and its control loop runs.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;

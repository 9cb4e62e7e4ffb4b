//! Code shared by the tests.

pub mod ask;
#[cfg(feature = "builder")]
pub mod baselines;
pub mod bus;
pub mod climb;
#[cfg(feature = "builder")]
pub mod deform;
#[cfg(feature = "builder")]
pub mod dibs;
#[cfg(feature = "builder")]
pub mod embedded;
#[cfg(feature = "builder")]
pub mod filter;
#[cfg(feature = "builder")]
pub mod hand;
#[cfg(feature = "builder")]
pub mod method;
#[cfg(feature = "builder")]
pub mod modal;
#[cfg(feature = "builder")]
pub mod motions;
pub mod oracle;
#[cfg(feature = "builder")]
pub mod posed;
#[cfg(feature = "builder")]
pub mod poses;
#[cfg(feature = "builder")]
pub mod side_poses;
pub mod sides;
#[cfg(feature = "builder")]
pub mod streams;
#[cfg(feature = "builder")]
pub mod stretch;
#[cfg(feature = "builder")]
pub mod surfaces;
pub mod tree_bytes;
#[cfg(feature = "builder")]
pub mod wanderer;

/// The number of cases of a slow test: a quarter of `whole`, or all if `DIBS_WHOLE` is set, as by `cargo xtask test
/// --whole`.
#[must_use]
pub fn sample(whole: usize) -> usize {
    if is_whole() { whole } else { whole.div_ceil(4) }
}

/// Whether the slow tests try all their cases.
#[must_use]
pub fn is_whole() -> bool {
    std::env::var_os("DIBS_WHOLE").is_some()
}

/// The README's code: it compiles, and its control loop runs.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;

/// The guide's code for the host: it compiles and runs. `tests/pages/new_user.rs` runs the code for the board.
#[cfg(doctest)]
#[doc = include_str!("../../docs/guide.md")]
pub struct Guide;

//! Atomics: the processor's, or with `--cfg loom` those of a model checker that tries every order in which two threads
//! may see them (`tests/soundness`).

// Requirement: F-01

#[cfg(loom)]
pub(crate) use loom::sync::atomic::{AtomicBool, AtomicU32, Ordering};
#[cfg(not(loom))]
pub(crate) use unmodelled::{AtomicBool, AtomicU32, Ordering};

/// Atomics that the model checker does not track. With the feature `portable-atomic`, on a processor without
/// compare-and-swap, each read-modify-write masks interrupts; loads and stores are the processor's.
pub(crate) mod unmodelled {
    #[cfg(not(feature = "portable-atomic"))]
    pub(crate) use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
    #[cfg(feature = "portable-atomic")]
    pub(crate) use portable_atomic::{AtomicBool, AtomicU32, Ordering};
}

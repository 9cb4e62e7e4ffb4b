//! Atomics: the processor's, or with `--cfg loom` those of a model checker that tries every order in which two threads
//! may see them (`tests/soundness`).

#[cfg(not(loom))]
pub(crate) use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
#[cfg(loom)]
pub(crate) use loom::sync::atomic::{AtomicBool, AtomicU32, Ordering};

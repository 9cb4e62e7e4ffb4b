//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A [`Tracker`](crate::Tracker)'s tick within a budget, with contacts or without, on a Cortex-M7.
    pub const M7_TICK: Self = Self { base: 10753, node_test: 115, triangle_test: 920 };
}

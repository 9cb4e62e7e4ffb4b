//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A [`Tracker`](crate::Tracker)'s tick within a budget on a surface that nodes carry, on a Cortex-M7.
    pub const M7_NODES_TICK: Self = Self { base: 7433, node_test: 370, triangle_test: 2960 };
}

//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 1846, node_test: 120, triangle_test: 1012 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1650, node_test: 126, triangle_test: 1127 };
}

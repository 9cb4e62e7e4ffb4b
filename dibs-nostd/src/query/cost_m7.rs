//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 1662, node_test: 196, triangle_test: 925 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1701, node_test: 212, triangle_test: 1052 };
}

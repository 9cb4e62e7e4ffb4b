//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 1368, node_test: 113, triangle_test: 986 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1465, node_test: 124, triangle_test: 1077 };
}

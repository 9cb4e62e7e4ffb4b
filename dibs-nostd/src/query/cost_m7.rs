//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 1428, node_test: 110, triangle_test: 979 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1424, node_test: 122, triangle_test: 1106 };
}

//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 1774, node_test: 114, triangle_test: 1003 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1648, node_test: 136, triangle_test: 1125 };
}

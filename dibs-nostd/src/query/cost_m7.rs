//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 2424, node_test: 117, triangle_test: 1098 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 1644, node_test: 150, triangle_test: 1203 };
}

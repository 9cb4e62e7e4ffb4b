//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on a Cortex-M7.
    pub const M7_SPHERE: Self = Self { base: 2998, node_test: 126, triangle_test: 1103 };
    /// A capsule on a Cortex-M7.
    pub const M7_CAPSULE: Self = Self { base: 2109, node_test: 159, triangle_test: 1177 };
}

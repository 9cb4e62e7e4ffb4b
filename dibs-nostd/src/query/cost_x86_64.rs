//! Measured by callgrind. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on x86-64, optimised.
    pub const X86_64_SPHERE: Self = Self { base: 2083, node_test: 141, triangle_test: 1375 };
    /// A capsule on x86-64, optimised.
    pub const X86_64_CAPSULE: Self = Self { base: 2343, node_test: 161, triangle_test: 1728 };
}

//! Measured by callgrind. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on x86-64, optimised.
    pub const X86_64_SPHERE: Self = Self { base: 1988, node_test: 168, triangle_test: 1280 };
    /// A capsule on x86-64, optimised.
    pub const X86_64_CAPSULE: Self = Self { base: 2066, node_test: 205, triangle_test: 1576 };
}

//! Measured by callgrind. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on x86-64, optimised.
    pub const X86_64_SPHERE: Self = Self { base: 10_000, node_test: 200, triangle_test: 1_000 };
    /// A capsule on x86-64, optimised.
    pub const X86_64_CAPSULE: Self = Self { base: 10_000, node_test: 200, triangle_test: 1_000 };
}

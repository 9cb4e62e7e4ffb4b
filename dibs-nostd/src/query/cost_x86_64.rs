//! Measured by callgrind. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on x86-64, optimised.
    pub const X86_64_SPHERE: Self = Self { base: 2150, node_test: 138, triangle_test: 1380 };
    /// A capsule on x86-64, optimised.
    pub const X86_64_CAPSULE: Self = Self { base: 2167, node_test: 170, triangle_test: 1695 };
}

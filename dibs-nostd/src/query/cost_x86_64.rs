//! Measured by callgrind. Written by `cargo xtask guarantees --fit`: do not edit.

use super::Cost;

impl Cost {
    /// A sphere on x86-64, optimised.
    pub const X86_64_SPHERE: Self = Self { base: 1979, node_test: 125, triangle_test: 1267 };
    /// A capsule on x86-64, optimised.
    pub const X86_64_CAPSULE: Self = Self { base: 2143, node_test: 148, triangle_test: 1584 };
}

//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

/// The budget in tests of each row.
pub const TESTS: &[(&str, u32)] = &[
    ("bounded.20k", 35),
    ("bounded.40k", 134),
    ("bounded.60k", 257),
    ("bounded.100k", 468),
    ("listed.40k", 43),
    ("listed.60k", 107),
    ("listed.100k", 319),
    ("dearer.fast", 247),
    ("dearer.large", 182),
    ("dearer.human", 182),
];

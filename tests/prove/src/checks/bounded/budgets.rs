//! Measured on an emulated Cortex-M7. Written by `cargo xtask guarantees --fit`: do not edit.

/// The budget in tests of each row.
pub const TESTS: &[(&str, u32)] = &[
    ("bounded.20k", 104),
    ("bounded.40k", 315),
    ("bounded.60k", 501),
    ("bounded.100k", 867),
    ("listed.40k", 290),
    ("listed.60k", 477),
    ("listed.100k", 867),
    ("dearer.fast", 496),
    ("dearer.large", 482),
    ("shaft.20k", 125),
    ("shaft.40k", 296),
    ("shaft.60k", 482),
    ("shaft.100k", 921),
    ("dearer.human", 487),
];

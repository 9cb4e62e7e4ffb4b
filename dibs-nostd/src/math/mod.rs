//! Arithmetic that gives the same bits on host and target, and `?` for `const` functions.

// Requirement: A-11

/// The operator `?`, for `const` functions.
macro_rules! tri {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(error) => return Err(error),
        }
    };
}

#[cfg(feature = "serde")]
pub(crate) mod no_limit;
pub(crate) mod order;
pub(crate) mod round;
pub(crate) mod sqrt;
pub(crate) mod vec3x4;

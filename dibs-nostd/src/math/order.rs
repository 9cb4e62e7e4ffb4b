//! The smaller and the larger of two numbers. `f32::min` and `f32::max` would hide a NaN.

// Requirement: A-11

/// `b` if it is smaller, else `a`: NaN if `a` is.
#[inline(always)]
pub(crate) const fn smaller(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// `b` if it is larger, else `a`: NaN if `a` is.
#[inline(always)]
pub(crate) const fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// The smaller number; NaN if either is.
pub(crate) fn smaller_or_nan(a: f32, b: f32) -> f32 {
    if b.is_nan() { b } else { smaller(a, b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A distance that is not a number is never replaced by one.
    #[test]
    fn no_number_hides_one_that_is_missing() {
        assert_eq!((smaller(1.0, 2.0), smaller(2.0, 1.0), larger(1.0, 2.0)), (1.0, 1.0, 2.0));
        assert!(smaller(f32::NAN, 1.0).is_nan() && larger(f32::NAN, 1.0).is_nan());
        assert_eq!((smaller(1.0, f32::NAN), larger(1.0, f32::NAN)), (1.0, 1.0));
        assert_eq!((smaller_or_nan(1.0, 2.0), smaller_or_nan(2.0, 1.0)), (1.0, 1.0));
        assert!(smaller_or_nan(f32::NAN, 1.0).is_nan() && smaller_or_nan(1.0, f32::NAN).is_nan());
    }
}

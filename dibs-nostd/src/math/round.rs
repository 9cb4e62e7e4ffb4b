//! The unit of rounding, and sums rounded up or down.

// Requirement: A-03

/// Half a unit in the last place of 1.
pub(crate) const U: f32 = 1.0 / 16_777_216.0;

/// `a + b`, rounded down; NaN if the sum is.
pub(crate) fn sum_down(a: f32, b: f32) -> f32 {
    let (sum, error) = two_sum(a, b);
    if error < 0.0 { sum.next_down() } else { sum }
}

/// `a + b`, rounded up; NaN if the sum is.
pub(crate) fn sum_up(a: f32, b: f32) -> f32 {
    let (sum, error) = two_sum(a, b);
    if error > 0.0 { sum.next_up() } else { sum }
}

/// A sum rounded to nearest, and its rounding error (Knuth's two-sum, exact unless the sum overflows).
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let rest = sum - a;
    (sum, (a - (sum - rest)) + (b - rest))
}

#[cfg(test)]
mod tests {
    use super::{sum_down, sum_up};

    #[test]
    fn sums_are_rounded_to_the_next_number_on_their_side() {
        let mut seed = 1_u32;
        for _ in 0..100_000 {
            let mut next = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f32::from_bits(((seed >> 1 & 0x07FF_FFFF) + (118 << 23)) ^ (seed >> 2 << 31))
            };
            let (a, b) = (next(), next());
            let sum = f64::from(a) + f64::from(b);
            let (down, up) = (sum_down(a, b), sum_up(a, b));
            assert!(f64::from(down) <= sum && sum <= f64::from(up), "{a} + {b}");
            assert!(up == down || up == down.next_up(), "{a} + {b}: {down} {up}");
        }
        assert_eq!((sum_down(3.0, 0.5), sum_up(3.0, 0.5)), (3.5, 3.5));
        assert!(sum_down(1.0, 1e-30) == 1.0 && sum_up(1.0, 1e-30) == 1.0_f32.next_up());
        assert!(sum_down(1.0, f32::NAN).is_nan());
        assert_eq!(sum_down(1.0, f32::NEG_INFINITY), f32::NEG_INFINITY);
    }
}

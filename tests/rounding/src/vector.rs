//! The vector of recorded numbers, with the operations of `glam::Vec3` in their order.

// Requirement: A-01

use std::ops::{Add, Mul, Sub};

use crate::tape::Traced;

/// Three recorded numbers.
#[derive(Clone, Copy, Debug)]
pub struct Vec3 {
    pub x: Traced,
    pub y: Traced,
    pub z: Traced,
}

impl Vec3 {
    pub const NAN: Self = Self { x: Traced::NAN, y: Traced::NAN, z: Traced::NAN };

    /// A vector whose components are made from the axes' names.
    pub fn of(component: impl Fn(char) -> Traced) -> Self {
        Self { x: component('x'), y: component('y'), z: component('z') }
    }

    pub fn dot(self, other: Self) -> Traced {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub fn length(self) -> Traced {
        self.dot(self).sqrt()
    }

    /// The components.
    pub fn each(self) -> [Traced; 3] {
        [self.x, self.y, self.z]
    }

    fn with(self, other: Self, operation: impl Fn(Traced, Traced) -> Traced) -> Self {
        Self {
            x: operation(self.x, other.x),
            y: operation(self.y, other.y),
            z: operation(self.z, other.z),
        }
    }

    /// The exact sum.
    pub fn plus(self, other: Self) -> Self {
        self.with(other, Traced::plus)
    }

    /// The exact dot product.
    pub fn exact_dot(self, other: Self) -> Traced {
        let [x, y, z] = self.with(other, Traced::times).each();
        x.plus(y).plus(z)
    }
}

impl Add for Vec3 {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Vec3 {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl Mul<Traced> for Vec3 {
    type Output = Self;

    fn mul(self, factor: Traced) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

#[cfg(test)]
mod tests {
    use dibs_nostd::Tool;

    use super::{Traced, Vec3};
    use crate::shipped::{Axis, Sphere};
    use crate::tape;

    fn traced(vector: glam::Vec3) -> Vec3 {
        let [x, y, z] = vector.to_array().map(Traced::literal);
        Vec3 { x, y, z }
    }

    /// That numbers have the same bits, or are NaN.
    fn assert_same(found: &[Traced], expected: &[f32]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            let found = found.value().expect("made of literals");
            let is_same = found.to_bits() == expected.to_bits();
            assert!(is_same || found.is_nan() && expected.is_nan(), "{found:e}, not {expected:e}");
        }
    }

    /// Another order of a sum, or one rounding more or less, would give other bits. Some results underflow or overflow.
    #[test]
    fn operations_have_the_bits_of_the_processor_and_of_glam() {
        let mut rng = fastrand::Rng::with_seed(24);
        for round in 0..8_000 {
            // Terms of like sizes, so that their order matters.
            let size = 2f32.powi(round % 160 - 80);
            let mut number = || (rng.f32() - 0.5) * size * [1.0, 0.125, 1.0][rng.usize(..3)];
            let mut vector = || glam::Vec3::new(number(), number(), number());
            let (a, b, s) = (vector(), vector(), vector().x);
            let compare = || {
                let (ta, tb, ts) = (traced(a), traced(b), Traced::literal(s));
                assert_same(&[ta.x + tb.x, ta.x - tb.x], &[a.x + b.x, a.x - b.x]);
                assert_same(&[ta.x * tb.x, ta.x * s], &[a.x * b.x, a.x * s]);
                assert_same(&[(ts * ts).sqrt(), ta.x.sqrt()], &[(s * s).sqrt(), a.x.sqrt()]);
                assert_eq!([ta.x > tb.x, ta.x < tb.x], [a.x > b.x, a.x < b.x]);
                assert_eq!([ta.x >= ta.x, ta.x <= tb.x], [true, a.x <= b.x]);
                assert_same(&(ta + tb).each(), &(a + b).to_array());
                assert_same(&(ta - tb).each(), &(a - b).to_array());
                assert_same(&(ta * ts).each(), &(a * s).to_array());
                assert_same(&[ta.dot(tb), ta.length()], &[a.dot(b), a.length()]);
                if let Ok(sphere) = dibs_nostd::Sphere::new(a, 0.0) {
                    let to = Sphere { centre: ta }.axis_to(tb);
                    assert_same(&to.each(), &sphere.axis_to(b).to_array());
                }
            };
            assert_eq!(tape::paths(compare).len(), 1, "a comparison of numbers is no choice");
        }
    }
}

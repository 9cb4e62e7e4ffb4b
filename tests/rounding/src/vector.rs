//! The vector of recorded numbers, with the operations of `glam::Vec3` in their order.

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

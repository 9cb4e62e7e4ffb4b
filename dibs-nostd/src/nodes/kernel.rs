//! The check of one element.
//!
//! Let `e1`, `e2`, `e3` be the current edges along the path through an element's four nodes, and `G` the matrix of
//! their products; `M` is the same at rest. The largest singular value of the deformation gradient is below `sigma`
//! exactly if `L M - G` is positive definite for `L = sigma^2`, because `G = E0^T F^T F E0` and `M = E0^T E0`. That is
//! so if its leading minors are positive. So the comparison with the largest `L` so far takes neither a root nor a
//! division, and no gradient. Comparisons are strict: with `>=` the minors of diag(0, 0, -1) would pass, and NaN fails.
//!
//! # Rounding
//!
//! Let `u = 2^-24`, and `X` be `L M - G` as computed. The entries of `G` come from differences of coordinates: those on
//! the diagonal have errors of at most `5 u` of themselves, others of `5 u |ei| |ej|`; a difference `L m - g` adds two
//! roundings. So, for `X` positive definite, `X` has an error of at most `6.1 u L m_ii` on the diagonal and
//! `12.1 u L sqrt(m_ii m_jj)` elsewhere. The minors are those of a matrix near `X`, as in an error analysis of
//! Cholesky's factorisation: `x11 x22 - x12^2` is exact for an `x22` changed by `2 u` of itself, `x11 x23 - x12 x13`
//! for an `x23` changed likewise, and the comparison of the products for an `x33` changed by `9 u`. In total `F^T F` is
//! at most `L` for an `M` larger by at most `44 u` of its diagonal; storing the entries adds `3 u`. With the least
//! eigenvalue `c` of `M` scaled to a diagonal of ones, its diagonal is at most `M / c`. So the builder divides `M` by
//! `1 + 50 u / c` ([`MARGIN`](super::MARGIN)), and an element that passes is not stretched beyond `sqrt(L)`.
//!
//! The volume `e1 . (e2 x e3)` has an error of at most `8 u sqrt(2) |e1| |e2| |e3|`, and no edge is longer than the
//! stretch limit times its rest length. So the builder stores `12 u s^3` times the product of the rest lengths: a
//! volume above it is positive.

// Requirement: F-07

use core::ops::{Add, BitAnd, Mul, Sub};

use glam::Vec4;

use super::layout::RestElement;
use crate::math::sqrt::sqrt;

/// One number, or one for each of four elements, with the same rounding.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// A truth value for each.
    type Mask: BitAnd<Output = Self::Mask>;

    fn splat(number: f32) -> Self;

    /// Whether it is greater than another; false for NaN.
    fn is_above(self, other: Self) -> Self::Mask;
}

impl Lanes for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        number
    }

    #[inline(always)]
    fn is_above(self, other: Self) -> bool {
        self > other
    }
}

impl Lanes for Vec4 {
    type Mask = u32;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self::splat(number)
    }

    #[inline(always)]
    fn is_above(self, other: Self) -> u32 {
        self.cmpgt(other).bitmask()
    }
}

/// The current shape of one element, or of four.
#[derive(Clone, Copy)]
pub(super) struct CurrentElement<T> {
    /// The products of its edges, in the order of [`RestElement::products`].
    products: [T; 6],
    volume: T,
}

impl<T: Lanes> CurrentElement<T> {
    /// The shape from the coordinates of its four nodes.
    #[inline(always)]
    pub fn of([a, b, c, d]: [[T; 3]; 4]) -> Self {
        let (first, second, third) = (minus(b, a), minus(c, b), minus(d, c));
        let products = [
            dot(first, first),
            dot(first, second),
            dot(first, third),
            dot(second, second),
            dot(second, third),
            dot(third, third),
        ];
        let ([x, y, z], [u, v, w]) = (second, third);
        let cross = [y * w - v * z, z * u - w * x, x * v - u * y];
        Self { products, volume: dot(first, cross) }
    }

    /// Whether its volume is positive; false for NaN.
    #[inline(always)]
    pub fn is_upright(&self, rest: &RestElement<T>) -> T::Mask {
        self.volume.is_above(rest.least)
    }

    /// Whether its stretch is certainly below `sqrt(limit)`; false for NaN.
    #[inline(always)]
    pub fn is_within(&self, rest: &RestElement<T>, limit: f32) -> T::Mask {
        let (limit, zero) = (T::splat(limit), T::splat(0.0));
        let [m11, m12, m13, m22, m23, m33] = rest.products;
        let [g11, g12, g13, g22, g23, g33] = self.products;
        let (x11, x12, x13) = (limit * m11 - g11, limit * m12 - g12, limit * m13 - g13);
        let (x22, x23, x33) = (limit * m22 - g22, limit * m23 - g23, limit * m33 - g33);
        let second = x11 * x22 - x12 * x12;
        let third = x11 * x33 - x13 * x13;
        let between = x11 * x23 - x12 * x13;
        // `&`, not `&&`: three comparisons cost less than branches.
        x11.is_above(zero) & second.is_above(zero) & (second * third).is_above(between * between)
    }

    /// The sum of the squares of its edges, current and at rest.
    #[inline(always)]
    pub fn sizes(&self, rest: &RestElement<T>) -> [T; 2] {
        let sum = |[first, _, _, second, _, third]: [T; 6]| first + second + third;
        [sum(self.products), sum(rest.products)]
    }
}

impl CurrentElement<f32> {
    /// The squared stretch of an element that is not within `from` but within `limit`, rounded up by at most
    /// [`HEADROOM`].
    #[cold]
    #[inline(never)]
    pub fn squared_stretch(&self, rest: &RestElement<f32>, from: f32, limit: f32) -> f32 {
        let (mut low, mut high) = (from, limit);
        // Enough for a limit of a million.
        for _ in 0..64 {
            if high - low <= high * HEADROOM {
                break;
            }
            let middle = low + (high - low) * 0.5;
            if self.is_within(rest, middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// The stretch of an element beyond the square `limit`, within one part in a thousand; infinite if it is not
    /// finite.
    #[cold]
    pub fn stretch_beyond(&self, rest: &RestElement<f32>, limit: f32) -> f32 {
        let (mut from, mut to) = (limit, limit * 2.0);
        for _ in 0..40 {
            if self.is_within(rest, to) {
                return sqrt(self.squared_stretch(rest, from, to));
            }
            (from, to) = (to, to * 2.0);
        }
        f32::INFINITY
    }
}

#[inline(always)]
fn minus<T: Lanes>([x, y, z]: [T; 3], [u, v, w]: [T; 3]) -> [T; 3] {
    [x - u, y - v, z - w]
}

#[inline(always)]
fn dot<T: Lanes>([x, y, z]: [T; 3], [u, v, w]: [T; 3]) -> T {
    x * u + y * v + z * w
}

/// Relative rounding up of a squared stretch. With it, other elements stretched nearly as much pass the quick check:
/// the full check takes twenty times as long.
const HEADROOM: f32 = 1.0 / 65_536.0;

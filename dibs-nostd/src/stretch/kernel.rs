//! The check of one triangle.
//!
//! Let `f1` and `f2` be the current edges from a triangle's centre to the other of its first two corners and to the
//! third, and `G` their Gram matrix, `[f1.f1, f1.f2; f1.f2, f2.f2]`; `M` is the same at rest, from the tree's metric
//! section. The triangle's largest singular value is at most `sigma` exactly if `L M - G` is positive semidefinite for
//! `L = sigma^2`: if its diagonal and its determinant are not negative. So the comparison with the largest `L` so far
//! takes neither a root nor a division. Only for a triangle that fails it the value is computed, and that value is used
//! only once it passes the same check.
//!
//! # Rounding
//!
//! Let `u = 2^-24`. The entries of `G` come from differences of coordinates: the diagonal's have errors of at most
//! `5 u` of themselves, the other of `5 u |f1| |f2|`. A difference `x = L a - g` adds two roundings, the comparison of
//! the products two. If it holds, then, with `a` and `d` the diagonal of `M`, `G` is below `L (M + E)` with
//! `|E11| <= 6.1 u a`, `|E22| <= 6.1 u d` and `|E12| <= 12.1 u sqrt(a d)`, so below `L (M + 18.2 u diag(a, d))`.
//! Storing the off-diagonal entry of `M`, whose lowest bit is a flag, adds `2 u sqrt(a d)`. And `diag(a, d)` is below
//! `M / (1 - |cos|)`, `cos` that of the angle at the centre. So the builder divides `M` by `1 + 21 u / (1 - |cos|)`,
//! rounding down, and a triangle that passes is not stretched beyond `sqrt(L)`. It chooses the centre that makes this
//! small. For edges the error is only 6.1 u.
//!
//! The builder avoids products that overflow or underflow; where it cannot, it stores a metric of zeros, which no
//! triangle passes.

// Requirement: F-02

use glam::{Vec3, Vec4};

use crate::math::round::U;
use crate::math::sqrt::sqrt;
use crate::math::vec3x4::Vec3x4;

/// The least square that is measured, that of a half: a smaller one would make no search faster, and products do not
/// underflow.
pub(crate) const LEAST: f32 = 0.25;

/// The largest squared stretch so far, relative to each triangle's limit, and its triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Worst {
    pub squared: f32,
    pub triangle: u32,
}

impl Worst {
    pub const fn none(triangle: u32) -> Self {
        Self { squared: LEAST, triangle }
    }
}

/// The squares compared for a triangle, current or at rest.
pub(super) type Squares = [f32; 3];

/// A triangle's current edges: from its centre to the other of its first two corners, and to the third.
#[derive(Clone, Copy)]
pub(super) struct Edges {
    pub first: Vec3,
    pub second: Vec3,
}

/// The measure of a path kind.
pub(super) trait Measure {
    /// The squares of a triangle's current edges.
    fn squares(now: Edges) -> Squares;

    /// Whether the stretch is certainly at most `sqrt(limit)`. False for NaN.
    fn within(rest: &Squares, now: &Squares, limit: f32) -> bool;

    /// The square of the stretch, approximately.
    fn estimate(rest: &Squares, now: &Squares) -> f32;

    /// The same as [`within`](Self::within), from the slack of the first edge (`first`, not negative) and of the second
    /// (`second`); `between` is the limit times the rest square. It may be false if `first` is 0. If it is true,
    /// `second` is positive.
    fn is_within(first: f32, second: f32, between: f32, now: Edges) -> bool;

    /// The same for four triangles with the edges `now`, one bit each.
    fn are_within(first: Vec4, second: Vec4, between: Vec4, now: [Vec3x4; 2]) -> u32;
}

/// The largest singular value.
pub(super) struct SingularValue;

impl Measure for SingularValue {
    #[inline(always)]
    fn squares(Edges { first, second }: Edges) -> Squares {
        [first.length_squared(), first.dot(second), second.length_squared()]
    }

    #[inline(always)]
    fn within(&[a, h, d]: &Squares, &[g11, g12, g22]: &Squares, limit: f32) -> bool {
        let (x, y, z) = (limit * a - g11, limit * h - g12, limit * d - g22);
        // Both are needed: a determinant is positive if both eigenvalues are negative, too.
        x * z >= y * y && x > 0.0
    }

    /// By `F^T F` in an orthonormal frame of the rest triangle.
    fn estimate(&[a, h, d]: &Squares, &[g11, g12, g22]: &Squares) -> f32 {
        let along = h / a;
        let height = d - along * h;
        let pp = g11 / a;
        let qq = (g22 - 2.0 * along * g12 + along * along * g11) / height;
        let pq = (g12 - along * g11) / sqrt(a * height);
        let (mean, half) = (0.5 * (pp + qq), 0.5 * (pp - qq));
        mean + sqrt(half * half + pq * pq)
    }

    /// A product above a square is positive, and so is `second`, since `first` is not negative.
    #[inline(always)]
    fn is_within(first: f32, second: f32, between: f32, now: Edges) -> bool {
        let between = between - now.first.dot(now.second);
        first * second > between * between
    }

    #[inline(always)]
    fn are_within(first: Vec4, second: Vec4, between: Vec4, now: [Vec3x4; 2]) -> u32 {
        let between = between - now[0].dot(now[1]);
        (first * second).cmpgt(between * between).bitmask()
    }
}

/// The largest ratio of an edge to its rest length.
pub(super) struct LongestEdge;

impl Measure for LongestEdge {
    #[inline(always)]
    fn squares(Edges { first, second }: Edges) -> Squares {
        [first.length_squared(), (second - first).length_squared(), second.length_squared()]
    }

    #[inline(always)]
    fn within(&[a, h, d]: &Squares, &[g1, g2, g3]: &Squares, limit: f32) -> bool {
        limit * a >= g1 && limit * h >= g2 && limit * d >= g3
    }

    fn estimate(rest: &Squares, now: &Squares) -> f32 {
        let mut worst = 0.0;
        for (rest, now) in rest.iter().zip(now) {
            let ratio = now / rest;
            // Written so that NaN is kept.
            if !(ratio <= worst) {
                worst = ratio;
            }
        }
        worst
    }

    #[inline(always)]
    fn is_within(_: f32, second: f32, between: f32, now: Edges) -> bool {
        second > 0.0 && between >= (now.second - now.first).length_squared()
    }

    #[inline(always)]
    fn are_within(_: Vec4, second: Vec4, between: Vec4, now: [Vec3x4; 2]) -> u32 {
        let third = now[1].minus(now[0]);
        (second.cmpgt(Vec4::ZERO) & between.cmpge(third.dot(third))).bitmask()
    }
}

/// Least relative rounding up of a triangle's squared stretch. It is more than rounding requires, so that other
/// triangles stretched nearly as much pass the quick check: the full check takes several times as long.
const HEADROOM: f32 = 256.0 * U;

/// The squared stretch of a triangle, rounded up, but not above the limit. If the triangle is not certainly within the
/// limit, the result is above the limit or NaN.
#[cold]
#[inline(never)]
pub(super) fn squared_stretch<M: Measure>(rest: &Squares, now: Edges, limit: f32) -> f32 {
    let now = M::squares(now);
    let estimate = M::estimate(rest, &now);
    let mut squared = if estimate.is_nan() { estimate } else { f32::INFINITY };
    // The estimate may be too low by its rounding: double the headroom until it passes.
    let mut step = HEADROOM;
    for _ in 0..24 {
        let candidate = estimate * (1.0 + step);
        if M::within(rest, &now, candidate) {
            squared = candidate;
            break;
        }
        step *= 2.0;
    }
    if !(squared <= limit) && M::within(rest, &now, limit) { limit } else { squared }
}

/// The square of a stretch limit, rounded down.
pub(crate) fn squared_limit(limit: f32) -> f32 {
    limit * limit * (1.0 - 2.0 * U)
}

pub(crate) fn root_up(squared: f32) -> f32 {
    sqrt(squared) * (1.0 + 4.0 * U)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A triangle that is within the limit by less than the rounding up counts as stretched to the limit, not beyond.
    #[test]
    fn a_triangle_just_within_the_limit_is_not_beyond_it() {
        just_within::<SingularValue>([1.0, 0.0, 1.0]);
        just_within::<LongestEdge>([1.0, 2.0, 1.0]);
    }

    /// Stretches a triangle of two edges of length 1 at a right angle by nearly 1.5.
    fn just_within<M: Measure>(rest: Squares) {
        let limit = 2.25;
        let squared = |length: f32| {
            let now = Edges { first: Vec3::X * length, second: Vec3::Y * length };
            squared_stretch::<M>(&rest, now, limit)
        };
        let bits = 1.5_f32.to_bits();
        for steps in 1..60 {
            let length = f32::from_bits(bits - steps);
            assert_eq!(squared(length), limit, "{length}");
            let length = f32::from_bits(bits + steps);
            assert!(squared(length) > limit, "{length}");
        }
        // The rounding up itself.
        let length = 1.4_f32;
        assert!(squared(length) > length * length && squared(length) < 1.97, "{length}");
    }

    proptest! {
        /// The limit's square is never above the exact one, and at most slightly below.
        #[test]
        fn a_limit_is_squared_downwards(limit in 1.0_f32..1e6) {
            let (exact, squared) = (f64::from(limit).powi(2), f64::from(squared_limit(limit)));
            prop_assert!(squared <= exact && squared >= exact * (1.0 - 5.0 * f64::from(U)));
        }

        /// A root is never below the exact one, and at most slightly above.
        #[test]
        fn a_root_is_taken_upwards(squared in LEAST..1e12) {
            let (exact, root) = (f64::from(squared).sqrt(), f64::from(root_up(squared)));
            prop_assert!(root >= exact && root <= exact * (1.0 + 7.0 * f64::from(U)));
        }
    }
}

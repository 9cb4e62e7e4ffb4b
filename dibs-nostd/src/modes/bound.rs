//! An upper bound on a modal surface's stretch, from its weights alone.
//!
//! Positions are linear in the weights, and so is each triangle's deformation gradient. Its largest singular value, a
//! norm, is therefore convex, as are an edge's length and the largest over all triangles. Two bounds follow for the
//! stretch `sigma(w)`, with `g_k` the largest norm of any triangle's gradient of mode `k`:
//!
//! - `sigma(w) <= sigma(a) + sum of g_k |w_k - a_k|`, from any shape `a`;
//! - `sigma(a + t (b - a)) <= (1 - t) sigma(a) + t sigma(b)`, between any two.
//!
//! The builder stores the weights of recorded shapes with their measured stretch, the *anchors*. The bound is the least
//! of those from each anchor, and those from the nearest point of the two segments that join the nearest recorded
//! anchor to its neighbours in time (the last is joined to the first). At a recorded frame the bound is that frame's
//! stretch, between two of them it is hardly more, and away from them it grows with the distance.
//!
//! Rounding. The arithmetic here is some tens of roundings deep: a relative 2^-16 covers it. The slack stored by the
//! builder covers the rounding of positions (a rounded vertex changes the gradient by its error over the triangle's
//! height) and of points on segments.

use super::layout::{self, Anchor};
use super::{Modes, WeightsError};
use crate::surface::MeasuredStretch;

/// Allowance for the f32 rounding of a bound.
pub(super) const ROUNDING: f32 = 1.0 + 1.0 / 65_536.0;

impl Modes<'_> {
    /// An upper bound on the stretch of the surface at these weights: never below the true one, and at the recorded
    /// frames equal to [`measure_stretch`](crate::measure_stretch) except for rounding. Its
    /// [`triangle`](MeasuredStretch::triangle) is the most stretched one in the nearest recorded frame.
    ///
    /// Cost: O(modes times anchors).
    ///
    /// # Errors
    /// [`WeightsError`] as from [`check`](Self::check).
    pub fn stretch_bound(&self, weights: &[f32]) -> Result<MeasuredStretch, WeightsError> {
        self.check(weights)?;
        Ok(self.bound(weights))
    }

    /// The same, for checked weights.
    pub(super) fn bound(&self, weights: &[f32]) -> MeasuredStretch {
        let mut sigma = f32::INFINITY;
        // The recorded shapes form a ring, because a beat ends where the next begins.
        let (mut nearest, mut shortest) = (1, f32::INFINITY);
        for row in 0..self.anchor_count() {
            let Some(anchor) = self.anchor(row) else { break };
            let away = self.growth_from(weights, anchor);
            if row > 0 && away < shortest {
                (nearest, shortest) = (row, away);
            }
            if anchor.sigma + away < sigma {
                sigma = anchor.sigma + away;
            }
        }
        let last = self.anchor_count().saturating_sub(1);
        let before = if nearest > 1 { nearest - 1 } else { last };
        let after = if nearest < last { nearest + 1 } else { 1 };
        let mut triangle = 0;
        if let Some(here) = self.anchor(nearest) {
            triangle = here.triangle;
            for there in [before, after].into_iter().filter_map(|row| self.anchor(row)) {
                let between = self.between(weights, here, there);
                if between < sigma {
                    sigma = between;
                }
            }
        }
        let sigma = sigma * ROUNDING + self.header.slack;
        MeasuredStretch::everywhere(sigma, self.motion.tree, triangle)
    }

    fn anchor(&self, row: usize) -> Option<Anchor<'_>> {
        layout::anchor(self.anchors, row, self.count())
    }

    /// Upper bound on the stretch added by the difference between an anchor's shape and these weights.
    fn growth_from(&self, weights: &[f32], anchor: Anchor<'_>) -> f32 {
        let mut sum = 0.0;
        for ((weight, from), mode) in weights.iter().zip(anchor.weights).zip(self.modes()) {
            sum += mode.growth * (weight - f32::from_le_bytes(*from)).abs();
        }
        sum
    }

    /// The bound from a point between two anchors, near these weights. Any point gives a valid bound.
    fn between(&self, weights: &[f32], a: Anchor<'_>, b: Anchor<'_>) -> f32 {
        let ends = || a.weights.iter().zip(b.weights).zip(self.modes());
        let (mut along, mut length) = (0.0, 0.0);
        for (weight, ((a, b), mode)) in weights.iter().zip(ends()) {
            let (a, b) = (f32::from_le_bytes(*a), f32::from_le_bytes(*b));
            let square = mode.growth * mode.growth;
            along += square * (weight - a) * (b - a);
            length += square * (b - a) * (b - a);
        }
        let t = along / length;
        // Also if two anchors are equal, and `t` is NaN.
        if !(t > 0.0 && t < 1.0) {
            return f32::INFINITY;
        }
        let mut away = 0.0;
        for (weight, ((a, b), mode)) in weights.iter().zip(ends()) {
            let (a, b) = (f32::from_le_bytes(*a), f32::from_le_bytes(*b));
            away += mode.growth * (weight - (a + t * (b - a))).abs();
        }
        a.sigma + t * (b.sigma - a.sigma) + away
    }
}

//! Positions of vertices, and boxes around them, computed from a volume's nodes.

use glam::Vec3A;

use super::aabb_tree::{Bounds, NOTHING, grown};

/// The binding of a vertex to the nodes of a volume.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    /// The four nodes of its element.
    pub nodes: [u32; 4],
    /// Their weights, whose sum is one.
    pub weights: [f32; 4],
}

impl Blend {
    /// The position at these nodes.
    #[inline(always)]
    #[must_use]
    pub fn of(&self, nodes: &[Vec3A]) -> Vec3A {
        let [a, b, c, d] = self.nodes.map(|node| nodes[node as usize]);
        let [u, v, w, _] = self.weights;
        d + (a - d) * u + (b - d) * v + (c - d) * w
    }
}

/// Largest rounding of a blend in f32, relative to its coordinates.
const ROUNDING: f32 = 1e-6;

/// A box around all vertices that are bound only to these nodes.
pub(super) fn around(nodes: &[Vec3A], of: &[u32]) -> Bounds {
    let [low, high] = of.iter().fold(NOTHING, |b, &node| grown(b, nodes[node as usize]));
    let rounding = Vec3A::splat(ROUNDING) * low.abs().max(high.abs());
    [low - rounding, high + rounding]
}

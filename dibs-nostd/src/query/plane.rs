//! Planes that reject leaves and triangles without a root of theirs.

use glam::Vec3;

use crate::{Index, Tree, VertexTable};

/// A plane: points beyond it are farther from the tool's axis than the cutoff.
///
/// For any vector `n` from the axis' nearest point `q` to some point, the axis lies where
/// `n . (x - q) <= 0`: it is convex. So all points of a patch with `n . (x - q) > cutoff |n|` at its
/// vertices are farther than the cutoff. No root is taken of what it rejects, and it is tighter than
/// any sphere around the patch: a sphere's lower bound is that of its farthest tangent plane.
pub(super) struct Plane {
    pub normal: Vec3,
    pub limit: f32,
}

impl Plane {
    /// Written so that not a number is not beyond.
    #[inline(always)]
    pub fn has_beyond(&self, point: Vec3) -> bool {
        self.normal.dot(point) > self.limit
    }

    /// How many of a leaf's triangles are beyond it, one after the other; `None` if its bytes are bad.
    ///
    /// Only the third corner of a triangle may be new to the leaf, but for the first triangle: the builder
    /// sees to it, the checker checks it. (A function of its own, so that the plane stays in registers.)
    #[inline(never)]
    pub fn beyond<I: Index, V: VertexTable + ?Sized>(
        &self,
        tree: &Tree<'_, I>,
        vertices: &V,
        first: u32,
        count: u32,
    ) -> Option<u32> {
        let mut triangles = tree.triangles(first, count)?;
        let [a, b, c] = triangles.next()?;
        if !self.has_beyond(vertices.position(a)?)
            || !self.has_beyond(vertices.position(b)?)
            || !self.has_beyond(vertices.position(c)?)
        {
            return Some(0);
        }
        for (before, [_, _, corner]) in (1..).zip(triangles) {
            if !self.has_beyond(vertices.position(corner)?) {
                return Some(before);
            }
        }
        Some(count)
    }
}

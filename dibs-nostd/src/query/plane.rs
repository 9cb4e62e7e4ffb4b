//! Planes that reject leaves and triangles without a square root.

use glam::Vec3;

use crate::{Index, Tree, VertexTable};

/// A plane: points beyond it are farther from the tool's axis than the cutoff.
///
/// For any vector `n` at the axis' point `q` nearest to some point, the axis lies where `n . (x - q) <= 0`, since it is
/// convex. So all points of a patch with `n . (x - q) > cutoff |n|` at its vertices are farther than the cutoff. The
/// plane is tighter than any sphere around the patch: the lower bound of a sphere is that of its farthest tangent
/// plane.
pub(super) struct Plane {
    pub normal: Vec3,
    pub limit: f32,
}

impl Plane {
    /// Written so that NaN is not beyond.
    #[inline(always)]
    pub fn has_beyond(&self, point: Vec3) -> bool {
        self.normal.dot(point) > self.limit
    }

    /// The number of a leaf's leading triangles that are beyond the plane; `None` if the leaf's bytes are bad.
    ///
    /// After the first triangle only a triangle's third corner may be new to the leaf: the builder sorts them so, and
    /// validation checks it. (A separate function, so that the plane stays in registers.)
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

    /// The least distance of a leaf's vertices beyond the plane, in units of the normal's length; zero or less if a
    /// vertex is not beyond. `None` if the leaf's bytes are bad.
    #[inline(never)]
    pub fn excess<I: Index, V: VertexTable + ?Sized>(
        &self,
        tree: &Tree<'_, I>,
        vertices: &V,
        first: u32,
        count: u32,
    ) -> Option<f32> {
        let along = |row| vertices.position(row).map(|position| self.normal.dot(position));
        let mut triangles = tree.triangles(first, count)?;
        let [a, b, c] = triangles.next()?;
        let mut lowest = least([along(a)?, along(b)?, along(c)?]);
        for [_, _, corner] in triangles {
            if !(lowest > self.limit) {
                break;
            }
            lowest = least([along(corner)?, lowest, lowest]);
        }
        Some(lowest - self.limit)
    }
}

/// The least of three numbers; NaN if the first is NaN. The others may be NaN: then they are not the least.
#[inline(always)]
pub(super) fn least([a, b, c]: [f32; 3]) -> f32 {
    let lower = if a > b { b } else { a };
    if lower > c { c } else { lower }
}

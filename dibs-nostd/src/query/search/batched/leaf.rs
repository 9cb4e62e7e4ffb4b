//! Leaves of a batch, and triangles four at a time.

use glam::Vec4;

use super::{BatchedSearch, next};
use crate::math::vec3x4::{Vec3x4, roots};
use crate::query::plane::Plane;
use crate::query::search::leaf::THIRD;
use crate::query::search::{Expansion, Search};
use crate::tree::format::{Node, NodeLink, whole_node};
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, VertexTable};

impl<I: Index, V: VertexTable + ?Sized, T: Tool> BatchedSearch<'_, '_, I, V, T> {
    /// Tests the planes of the children that are leaves. Returns the set of remaining children.
    #[inline(always)]
    pub(super) fn reject_leaves(&mut self, near: u64, mut leaves: u64) -> Option<u64> {
        let (tree, vertices) = (self.search.tree, self.search.vertices);
        let mut left = near;
        while let Some(at) = next(&mut leaves) {
            let Node { pin, link, .. } = whole_node::<I>(&self.records, at as u32)?;
            if let NodeLink::Leaf { first, count } = NodeLink::decode(link)
                && self.search.meter.node().is_some()
            {
                let plane = self.search.plane_towards(vertices.position(pin)?);
                let within = plane.vertices_within(tree, vertices, first, count)?;
                left &= !(u64::from(within == 0) << at);
            }
        }
        Some(left)
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// As [`Search::leaf`], but tests four triangles at a time, from the first that the plane does not reject, each
    /// against its own plane only.
    #[inline(always)]
    pub(super) fn leaf_at_once(&mut self, first: u32, count: u32) -> Result<Expansion, QueryError> {
        if self.meter.node().is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        let corrupt = QueryError::Corrupt { row: first };
        let (tree, vertices) = (self.tree, self.vertices);
        let [corner, ..] = tree.triangle(first).ok_or(corrupt)?;
        let plane = self.plane_towards(self.position(corner)?);
        let within = plane.vertices_within(tree, vertices, first, count).ok_or(corrupt)?;
        if within == 0 {
            return Ok(Expansion::Done);
        }
        // From the third vertex on, each is the last corner of a triangle, and the triangles before it are beyond the
        // plane.
        let beyond = within.trailing_zeros().saturating_sub(2);
        let (mut first, mut count) = (first + beyond, count.saturating_sub(beyond));
        if self.meter.nodes(count).is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        while count > 0 {
            let [a, b, c] = tree.four_triangles(first, count).ok_or(corrupt)?;
            let corners = |rows| Vec3x4::of(|row| vertices.position(row), rows).ok_or(corrupt);
            let within = self.within_own_planes(corners(a)?, corners(b)?, corners(c)?);
            let mut within = u64::from(within) & !(u64::MAX << count);
            while let Some(at) = next(&mut within) {
                if let Expansion::OutOfBudget = self.triangle(first + at as u32)? {
                    return Ok(Expansion::OutOfBudget);
                }
            }
            first += 4;
            count = count.saturating_sub(4);
        }
        Ok(Expansion::Done)
    }

    /// Tests a triangle if the budget suffices.
    #[inline(always)]
    fn triangle(&mut self, triangle: u32) -> Result<Expansion, QueryError> {
        if triangle == self.best_triangle {
            return Ok(Expansion::Done);
        }
        if self.meter.triangle().is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        let corners = self.corners(triangle)?;
        let [a, b, c] = corners;
        // A corner that is not finite makes the sum not finite.
        if !(a + b + c).is_finite() {
            return Err(QueryError::Position { vertex: self.not_finite(triangle) });
        }
        self.test_triangle(triangle, &corners);
        Ok(Expansion::Done)
    }

    /// The set of those of four triangles that are not beyond their plane towards the corners' mean.
    #[inline(always)]
    fn within_own_planes(&self, a: Vec3x4, b: Vec3x4, c: Vec3x4) -> u32 {
        let mean = a.plus(b).plus(c).times(Vec4::splat(THIRD));
        let normal = self.tool.axis_to_four(&mean);
        let beyond = roots(normal.dot(normal)) * (self.cutoff + self.coordinate_slack);
        let limit = normal.dot(mean.minus(normal)) + beyond + self.tilt_slack;
        within(normal, limit, a) | within(normal, limit, b) | within(normal, limit, c)
    }
}

impl Plane {
    /// The set of a leaf's vertices that are not beyond the plane, in the order in which its triangles list them.
    #[inline(always)]
    fn vertices_within<I: Index, V: VertexTable + ?Sized>(
        &self,
        tree: &Tree<'_, I>,
        vertices: &V,
        first: u32,
        count: u32,
    ) -> Option<u32> {
        let (normal, limit) = (Vec3x4::splat(self.normal), Vec4::splat(self.limit));
        let [a, b, c, d, e, f, g, h, i, j, k, l] = tree.leaf_vertices(first, count)?;
        let (one, two) = (
            Vec3x4::of(|row| vertices.position(row), [a, b, c, d])?,
            Vec3x4::of(|row| vertices.position(row), [e, f, g, h])?,
        );
        let mut set = within(normal, limit, one) | within(normal, limit, two) << 4;
        if count > 6 {
            set |=
                within(normal, limit, Vec3x4::of(|row| vertices.position(row), [i, j, k, l])?) << 8;
        }
        Some(set & !(u32::MAX << (count + 2)))
    }
}

/// The set of those of four points that are not beyond a plane, or each its own plane. NaN is not beyond.
#[inline(always)]
fn within(normal: Vec3x4, limit: Vec4, points: Vec3x4) -> u32 {
    !normal.dot(points).cmpgt(limit).bitmask() & 0xF
}

//! The tests of a leaf and of its triangles.

use glam::Vec3;

use super::{Expansion, Search, ties};
use crate::math::sqrt::sqrt;
use crate::query::corners::positions;
use crate::query::plane::{Plane, least};
use crate::tool::{AxisPair, Tool};
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// Weight of each corner in the mean towards which a triangle's plane is turned.
pub(super) const THIRD: f32 = 1.0 / 3.0;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Tests a leaf that is nearer than all waiting subtrees: its vertices against one plane; then each triangle, from
    /// the first that the plane does not reject, against the same plane and its own.
    #[inline(always)]
    pub(super) fn leaf(&mut self, first: u32, count: u32) -> Result<Expansion, QueryError> {
        if self.meter.node().is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        let corrupt = QueryError::Corrupt { row: first };
        let [corner, ..] = self.tree.triangle(first).ok_or(corrupt)?;
        let patch_plane = self.plane_towards(self.position(corner)?);
        let beyond = patch_plane.beyond(self.tree, self.vertices, first, count).ok_or(corrupt)?;
        if beyond == count {
            return Ok(Expansion::Done);
        }
        let tree = self.tree;
        let (first, count) = (first + beyond, count - beyond);
        let triangles = tree.triangles(first, count).ok_or(corrupt)?;
        for (triangle, corners) in (first..).zip(triangles) {
            if triangle == self.best_triangle {
                continue;
            }
            if self.meter.triangle_plane().is_none() {
                return Ok(Expansion::OutOfBudget);
            }
            let [a, b, c] = corners;
            let [a, b, c] = [self.position(a)?, self.position(b)?, self.position(c)?];
            if patch_plane.has_beyond(a) && patch_plane.has_beyond(b) && patch_plane.has_beyond(c) {
                continue;
            }
            let plane = self.plane_towards((a + b + c) * THIRD);
            if plane.has_beyond(a) && plane.has_beyond(b) && plane.has_beyond(c) {
                continue;
            }
            // A corner that is not finite makes the limit NaN.
            if plane.limit.is_nan() {
                return Err(QueryError::Position { vertex: self.not_finite(triangle) });
            }
            self.meter.spare_triangle();
            self.test_triangle(triangle, &[a, b, c]);
        }
        Ok(Expansion::Done)
    }

    #[inline(always)]
    pub(super) fn plane_towards(&self, point: Vec3) -> Plane {
        let normal = self.tool.axis_to(point);
        self.plane_across(normal, point, sqrt(normal.dot(normal)))
    }

    /// The plane through a point perpendicular to the shortest vector from the axis to it, of this length.
    #[inline(always)]
    pub(super) fn plane_across(&self, normal: Vec3, point: Vec3, length: f32) -> Plane {
        let on_axis = point - normal;
        let beyond = (self.cutoff + self.coordinate_slack) * length;
        Plane { normal, limit: normal.dot(on_axis) + beyond + self.tilt_slack }
    }

    #[inline(always)]
    pub(super) fn position(&self, row: u32) -> Result<Vec3, QueryError> {
        self.vertices.position(row).ok_or(QueryError::Corrupt { row })
    }

    #[inline(always)]
    pub(super) fn corners(&self, triangle: u32) -> Result<[Vec3; 3], QueryError> {
        let rows = self.tree.triangle(triangle).ok_or(QueryError::Corrupt { row: triangle })?;
        positions(self.vertices, rows)
    }

    /// The exact test; the caller has counted it.
    #[inline(always)]
    pub(super) fn test_triangle(&mut self, triangle: u32, corners: &[Vec3; 3]) {
        if let Some(pair) = self.tool.closest_on_triangle(corners, self.cutoff_squared) {
            if pair.distance_squared < self.best_squared {
                self.improve(triangle, pair, sqrt(pair.distance_squared));
            }
            self.add_tie(triangle, pair.distance_squared);
        }
    }

    /// Tests a triangle against its own plane, and exactly unless the plane rejects it; the caller has counted the
    /// plane test. Returns a lower bound on its distance, and whether it is the closest so far.
    #[inline(always)]
    pub(super) fn bound_triangle(
        &mut self,
        triangle: u32,
        corners: &[Vec3; 3],
    ) -> Result<(f32, bool), QueryError> {
        let (excess, length) = self.excess(corners);
        if excess.is_nan() {
            return Err(QueryError::Position { vertex: self.not_finite(triangle) });
        }
        if excess > 0.0 {
            return Ok((self.cutoff + excess / length, false));
        }
        self.meter.spare_triangle();
        let Some(pair) = self.tool.closest_on_triangle(corners, f32::INFINITY) else {
            return Err(QueryError::Position { vertex: self.not_finite(triangle) });
        };
        let distance = sqrt(pair.distance_squared);
        let is_closest = pair.distance_squared < self.best_squared;
        if is_closest {
            self.improve(triangle, pair, distance);
        }
        self.add_tie(triangle, pair.distance_squared);
        Ok((distance, is_closest))
    }

    /// A triangle's excess beyond the cutoff along its own plane's normal, and the length of that normal. NaN if a
    /// corner is not finite.
    #[inline(always)]
    pub(super) fn excess(&self, &[a, b, c]: &[Vec3; 3]) -> (f32, f32) {
        let middle = (a + b + c) * THIRD;
        let normal = self.tool.axis_to(middle);
        let length = sqrt(normal.dot(normal));
        let plane = self.plane_across(normal, middle, length);
        (least([a, b, c].map(|corner| plane.normal.dot(corner))) - plane.limit, length)
    }

    /// Records a triangle as the closest so far.
    #[inline(always)]
    fn improve(&mut self, triangle: u32, pair: AxisPair, distance: f32) {
        self.best_squared = pair.distance_squared;
        self.best_triangle = triangle;
        self.best = Some(pair);
        self.lower_cutoff(distance);
        if self.ties.is_some() {
            self.tie_squared = ties::limit_of(distance, self.scale);
        }
    }

    /// Collects a triangle if it may be the closest; `square` is a bound on its squared distance.
    #[inline(always)]
    pub(super) fn add_tie(&mut self, triangle: u32, square: f32) {
        if square <= self.tie_squared
            && let Some(ties) = &mut self.ties
        {
            ties.push(triangle, square, self.tie_squared);
        }
    }

    /// The corner of a triangle that is not finite; the first if all are finite.
    #[cold]
    pub(super) fn not_finite(&self, triangle: u32) -> u32 {
        let rows = self.tree.triangle(triangle).unwrap_or_default();
        let is_finite = |row| self.vertices.position(row).is_some_and(Vec3::is_finite);
        rows.into_iter().find(|&row| !is_finite(row)).unwrap_or(rows[0])
    }
}

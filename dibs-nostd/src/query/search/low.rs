//! A leaf's triangles that may be a local minimum of the distance.
//!
//! The square of the distance from the axis is convex in space, and its gradient is twice the vector from the axis. So
//! over a triangle it is at least the value at the lowest corner plus the least rise towards the other two. If that is
//! at most `prominence / 2` below the corner's distance, and at most a 512th of it, and a vertex next to that corner is
//! lower, the triangle is no local minimum: the triangles around the corner lead down, over no ridge of that height.
//! Nor is it if its lowest point is on an edge and the opposite vertex of the edge's other triangle is lower. All other
//! triangles may be local minima.
//!
//! Each step down leads to a triangle with a lower lowest corner, so it ends at a triangle that is kept, at most
//! `prominence / 2` above the first one.

// Requirement: S-04

use glam::Vec3;

use super::Search;
use super::heights::{CacheSlot, Heights, Vertex};
use crate::math::order::smaller;
use crate::query::prices::{CANDIDATE, FACING, ON_EDGE};
use crate::tool::{AxisPair, SLIVER, Tool};
use crate::tree::{MAX_RING, after, before};
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// A fall by less than this fraction of the squared distance is ignored: a prominence of a 512th of the distance.
const FLAT: f32 = 1.0 / 256.0;

/// A triangle as seen from the axis.
struct TriangleHeight {
    lowest: CacheSlot,
    /// Lower bound on the square of its distance.
    low: f32,
    /// Whether and where it may be lower than its lowest corner.
    dip: Dip,
}

/// Where a triangle may be lower than its lowest corner by more than the tolerance.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Dip {
    Nowhere,
    /// Along one edge, towards another corner.
    Edge(u32),
    Anywhere,
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Visits a leaf's triangles within the cutoff that may be local minima, ignoring prominences up to `prominence`. A
    /// visit returns the next limit. Returns the least lower bound on a triangle's squared distance; `None` if the
    /// budget ran out.
    ///
    /// Triangles that represent their lowest corners are visited later, when the cache evicts these.
    #[inline(never)]
    pub(super) fn visit_low(
        &mut self,
        first: u32,
        count: u32,
        prominence: f32,
        heights: &mut Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<Option<f32>, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let tree = self.tree;
        let mut least = f32::INFINITY;
        for (triangle, rows) in (first..).zip(tree.triangles(first, count).ok_or(corrupt)?) {
            if heights.leaves_out(tree, triangle) {
                continue;
            }
            let seen = self.see(rows, prominence, heights)?;
            if seen.low < least {
                least = seen.low;
            }
            let is_low = if seen.low > self.cutoff_squared {
                Some(false)
            } else {
                match seen.dip {
                    Dip::Nowhere => {
                        heights.add_candidate(seen.lowest, triangle);
                        Some(false)
                    }
                    Dip::Edge(edge) => {
                        self.may_be_low_at_edge(triangle, edge, seen.low, heights)?
                    }
                    Dip::Anywhere => self.is_outside(triangle, heights)?,
                }
            };
            let Some(is_low) = is_low else { return Ok(None) };
            if is_low && !self.visit_triangle(triangle, visit)? {
                return Ok(None);
            }
            while let Some(&vertex) = heights.evicted() {
                if !self.visit_candidate(&vertex, heights, visit)? {
                    return Ok(None);
                }
                heights.drop_evicted();
            }
        }
        Ok(Some(least))
    }

    /// Visits the triangle that represents a vertex, unless a lower vertex is next to it. Its side is not checked,
    /// since other triangles around the vertex may face the tool. Returns `false` if the budget ran out.
    pub(super) fn visit_candidate(
        &mut self,
        vertex: &Vertex,
        heights: &Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        let Some(triangle) = vertex.candidate() else { return Ok(true) };
        if self.pay(heights.is_priced, CANDIDATE).is_none() {
            return Ok(false);
        }
        match self.is_lowest(triangle, vertex, heights)? {
            None => Ok(false),
            Some(false) => Ok(true),
            Some(true) => self.visit_triangle(triangle, visit),
        }
    }

    /// Tests a triangle exactly. Returns `false` if the budget ran out.
    #[inline(always)]
    fn visit_triangle(
        &mut self,
        triangle: u32,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        if self.meter.triangle().is_none() {
            return Ok(false);
        }
        let corners = self.corners(triangle)?;
        if let Some(pair) = self.tool.closest_on_triangle(&corners, self.cutoff_squared) {
            let limit = visit(triangle, &pair);
            self.set_limit(limit);
        }
        Ok(true)
    }

    /// Compares a triangle's corners.
    #[inline(always)]
    fn see(
        &self,
        rows: [u32; 3],
        prominence: f32,
        heights: &mut Heights,
    ) -> Result<TriangleHeight, QueryError> {
        let [a, b, c] = self.slots(heights, rows)?;
        let is_below = |one: CacheSlot, other: CacheSlot| {
            let (one, other) = (heights.at(one), heights.at(other));
            one.square < other.square || one.square == other.square && one.row < other.row
        };
        let (index, lowest, next, last) = if is_below(a, b) && is_below(a, c) {
            (0, a, b, c)
        } else if is_below(b, c) {
            (1, b, c, a)
        } else {
            (2, c, a, b)
        };
        heights.resolve(next);
        heights.resolve(last);
        let &Vertex { square, position, towards, .. } = heights.at(lowest);
        let rise = |to: CacheSlot| towards.dot(heights.at(to).position - position);
        let (along, across) = (rise(next), rise(last));
        let least = smaller(across, along);
        if least >= self.tilt_slack {
            return Ok(TriangleHeight { lowest, low: square - self.tilt_slack, dip: Dip::Nowhere });
        }
        // The slack of the tilt covers the rounding of a rise and of the square.
        let fall = (if least < 0.0 { -2.0 * least } else { 0.0 }) + 3.0 * self.tilt_slack;
        // `h - sqrt(h^2 - fall) <= prominence / 2` without roots: `fall + prominence^2 / 4 <= prominence h`.
        let quarter = 0.25 * prominence * prominence;
        let is_level = (fall + quarter) * (fall + quarter) <= prominence * prominence * square;
        let dip = if is_level && fall <= square * FLAT {
            Dip::Nowhere
        } else if across >= self.tilt_slack {
            Dip::Edge(index)
        } else if along >= self.tilt_slack {
            Dip::Edge(before(index))
        } else {
            Dip::Anywhere
        };
        Ok(TriangleHeight { lowest, low: square - fall, dip })
    }

    /// Whether a triangle of a closed surface is seen from outside, as far as known. `None` if the budget ran out.
    #[inline(always)]
    fn is_outside(&mut self, triangle: u32, heights: &Heights) -> Result<Option<bool>, QueryError> {
        // At the border of a label's part, the edge's other triangle is left out.
        if !self.tree.is_closed() || heights.is_of_part() {
            return Ok(Some(true));
        }
        let price = if heights.is_priced { 1 + FACING } else { 1 };
        if self.meter.nodes(price).is_none() {
            return Ok(None);
        }
        Ok(Some(!self.is_inside(&self.corners(triangle)?)))
    }

    /// Whether the axis is on the inner side of a triangle of a closed surface wherever it is closest to the triangle.
    /// Then there is no contact: if the closest point is on an edge, and the axis outside, it is above the edge's other
    /// triangle.
    ///
    /// Along a line in the triangle the axis' closest point moves monotonically, and so does its height over the
    /// triangle's plane: the largest height is at a corner.
    #[inline(always)]
    fn is_inside(&self, corners: &[Vec3; 3]) -> bool {
        let &[a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let square = normal.length_squared();
        let is_clear = square > SLIVER * ab.length_squared() * ac.length_squared();
        let slack = self.slack + self.coordinate_slack;
        let is_below = |&corner: &Vec3| {
            let towards = self.tool.axis_to(corner);
            let depth = normal.dot(towards);
            let doubt = slack * slack + SLIVER * towards.length_squared();
            depth > 0.0 && depth * depth > doubt * square
        };
        is_clear && corners.iter().all(is_below)
    }

    /// Whether no vertex next to a triangle's lowest corner is lower. `None` if the budget ran out.
    fn is_lowest(
        &mut self,
        triangle: u32,
        vertex: &Vertex,
        heights: &Heights,
    ) -> Result<Option<bool>, QueryError> {
        let tree = self.tree;
        let rows = tree.triangle(triangle).ok_or(QueryError::Corrupt { row: triangle })?;
        let start = if rows[0] == vertex.row {
            0
        } else if rows[1] == vertex.row {
            1
        } else {
            2
        };
        let (mut row, mut corner, mut is_back) = (triangle, start, false);
        for _ in 0..MAX_RING {
            let step = if is_back {
                tree.across(row, before(corner))
            } else {
                tree.next_around(row, corner)
            };
            let Some((next, next_corner)) = step else {
                // At a border: from the first triangle in the other direction.
                if is_back {
                    break;
                }
                (row, corner, is_back) = (triangle, start, true);
                continue;
            };
            if next == triangle {
                break;
            }
            if self.meter.node().is_none() {
                return Ok(None);
            }
            (row, corner) = (next, next_corner);
            // Its corners may be seen again with a triangle of the part; if not, one more triangle counts as low.
            if heights.leaves_out(tree, row) {
                continue;
            }
            let new = if is_back { before(corner) } else { after(corner) };
            let (new, square) = self.corner(row, new, heights)?;
            if square < vertex.square || square == vertex.square && new < vertex.row {
                return Ok(Some(false));
            }
        }
        Ok(Some(true))
    }

    /// Whether a triangle whose lowest point seems to be on `edge` may be a local minimum. It is not if that point is
    /// certainly on the edge and the vertex beyond is lower, nor if the axis is on its inner side. `None` if the
    /// budget ran out.
    fn may_be_low_at_edge(
        &mut self,
        triangle: u32,
        edge: u32,
        low: f32,
        heights: &Heights,
    ) -> Result<Option<bool>, QueryError> {
        if let Some((row, other)) = self.tree.across(triangle, edge)
            && !heights.leaves_out(self.tree, row)
        {
            if self.meter.node().is_none() {
                return Ok(None);
            }
            let (_, beyond) = self.corner(row, before(other), heights)?;
            if beyond < low {
                if self.pay(heights.is_priced, ON_EDGE).is_none() {
                    return Ok(None);
                }
                if self.is_lowest_on(edge, &self.corners(triangle)?) {
                    return Ok(Some(false));
                }
            }
        }
        self.is_outside(triangle, heights)
    }

    /// Whether a triangle's lowest point is certainly on an edge: from the whole edge the distance rises towards the
    /// third corner. Half the gradient at a point is the vector to it from the axis' closest point. Along the edge both
    /// change monotonically, so the four pairs of ends bound the rise.
    #[inline(never)]
    fn is_lowest_on(&self, edge: u32, &[a, b, c]: &[Vec3; 3]) -> bool {
        let (from, to, third) = match edge {
            0 => (a, b, c),
            1 => (b, c, a),
            _ => (c, a, b),
        };
        let inward = third - from;
        let rises = |(point, by): (Vec3, Vec3)| {
            let on_axis = by - self.tool.axis_to(by);
            inward.dot(point - on_axis) >= self.tilt_slack
        };
        [(from, from), (from, to), (to, from), (to, to)].into_iter().all(rises)
    }

    /// The vertex row and the height of a triangle's corner.
    fn corner(
        &self,
        triangle: u32,
        index: u32,
        heights: &Heights,
    ) -> Result<(u32, f32), QueryError> {
        let corrupt = QueryError::Corrupt { row: triangle };
        let rows = self.tree.triangle(triangle).ok_or(corrupt)?;
        let &vertex = rows.get(index as usize).ok_or(corrupt)?;
        Ok((vertex, self.height(heights, vertex)?))
    }
}

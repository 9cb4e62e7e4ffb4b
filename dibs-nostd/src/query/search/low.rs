//! A leaf's triangles that may be the lowest of their surroundings.
//!
//! The square of the distance from the axis is convex in space, and twice the vector from the axis is its gradient. So
//! over a triangle it is at least the value at the lowest corner plus the least rise towards the other two. Where that
//! is no more than `ridge / 2` below the corner's distance, and a vertex next to that corner is lower, the triangle is
//! not the lowest: the triangles around the corner lead down, over no ridge of that height. Where the triangle may dip
//! across one edge, and the vertex beyond it is lower than the dip, neither is it. All others may be.
//!
//! Each step down leads to a triangle with a lower lowest corner, so it ends at a triangle that is kept, `ridge / 2`
//! above the first one at most.

use glam::Vec3;

use super::Search;
use super::heights::Heights;
use crate::tool::{SLIVER, Tool};
use crate::tree::format::MAX_LEAF_TRIANGLES;
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// Most triangles of a leaf.
const MOST: usize = MAX_LEAF_TRIANGLES as usize;
/// Most triangles that are turned through around a vertex.
const MAX_RING: u32 = 256;

/// A vertex, and the square of its distance. Vertices that are equally far are in the order of their rows.
#[derive(Clone, Copy)]
struct Corner {
    square: f32,
    vertex: u32,
}

impl Corner {
    /// Whether this one is lower than another.
    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self.square < other.square || self.square == other.square && self.vertex < other.vertex
    }
}

/// A triangle, seen from the axis.
#[derive(Clone, Copy)]
struct Seen {
    /// Its lowest corner, and that corner's index.
    corner: Corner,
    index: u32,
    /// Lower bound on the square of its distance.
    low: f32,
    /// Where it may be lower than its lowest corner.
    dip: Dip,
}

/// Where a triangle may be lower than its lowest corner, by more than counts.
#[derive(Clone, Copy)]
enum Dip {
    Nowhere,
    /// Along one edge, towards another corner.
    Edge(u32),
    Anywhere,
}

/// A leaf's triangles, and the vertices seen, from leaf to leaf.
pub(super) struct Low {
    leaf: [Seen; MOST],
    heights: Heights,
}

impl Low {
    pub const fn new() -> Self {
        let corner = Corner { square: f32::INFINITY, vertex: 0 };
        let none = Seen { corner, index: 0, low: f32::INFINITY, dip: Dip::Nowhere };
        Self { leaf: [none; MOST], heights: Heights::new() }
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Visits a leaf's triangles within the cutoff that may be the lowest of their surroundings, but for ridges of
    /// `ridge`. A visit returns the next limit. Returns whether the budget was enough.
    pub(super) fn visit_low(
        &mut self,
        first: u32,
        count: u32,
        ridge: f32,
        low: &mut Low,
        visit: &mut impl FnMut(u32, f32) -> f32,
    ) -> Result<bool, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let Low { leaf, heights } = low;
        let tree = self.tree;
        let triangles = tree.triangles(first, count).ok_or(corrupt)?;
        for (seen, rows) in leaf.iter_mut().zip(triangles) {
            *seen = self.see(rows, ridge, heights)?;
        }
        for (seen, triangle) in leaf.iter().take(count as usize).zip(first..) {
            if seen.low > self.cutoff_squared {
                continue;
            }
            let is_low = match seen.dip {
                Dip::Nowhere => self.is_low(triangle, seen, heights)?,
                Dip::Edge(edge) => self.dips(triangle, edge, seen.low, heights)?,
                Dip::Anywhere => Some(true),
            };
            match is_low {
                None => return Ok(false),
                Some(false) => continue,
                Some(true) => (),
            }
            let corners = self.corners(triangle)?;
            // A triangle that stands for its lowest corner is kept: others there may face the tool.
            if tree.is_closed() && !matches!(seen.dip, Dip::Nowhere) {
                let Some(left) = self.left.node_tests.checked_sub(1) else { return Ok(false) };
                self.left.node_tests = left;
                if self.is_inside(&corners) {
                    continue;
                }
            }
            let Some(left) = self.left.triangle_tests.checked_sub(1) else { return Ok(false) };
            self.left.triangle_tests = left;
            if let Some(pair) = self.tool.closest_on_triangle(&corners, self.cutoff_squared) {
                let limit = visit(triangle, pair.distance_squared);
                self.set_limit(limit);
            }
        }
        Ok(true)
    }

    /// Compares a triangle's corners.
    #[inline(always)]
    fn see(&self, rows: [u32; 3], ridge: f32, heights: &mut Heights) -> Result<Seen, QueryError> {
        let [a, b, c] = rows;
        let (p, at_a) = self.height(heights, a)?;
        let (q, at_b) = self.height(heights, b)?;
        let (r, at_c) = self.height(heights, c)?;
        let (a, b, c) = (
            Corner { square: p, vertex: a },
            Corner { square: q, vertex: b },
            Corner { square: r, vertex: c },
        );
        let (index, corner, next, last, origin, along, across) = if a.is_below(b) && a.is_below(c) {
            (0, a, b, c, at_a, at_b, at_c)
        } else if b.is_below(c) {
            (1, b, c, a, at_b, at_c, at_a)
        } else {
            (2, c, a, b, at_c, at_a, at_b)
        };
        heights.settle(next.vertex);
        heights.settle(last.vertex);
        let gradient: Vec3 = self.tool.axis_to(origin);
        let (along, across) = (gradient.dot(along - origin), gradient.dot(across - origin));
        let least = if along < across { along } else { across };
        // The rounding of a rise is less than the tilt's slack, and so is that of the square.
        let fall = if least < 0.0 { -2.0 * least } else { 0.0 } + 3.0 * self.tilt_slack;
        let low = corner.square - fall;
        let quarter = 0.25 * ridge * ridge;
        let is_shallow = (fall + quarter) * (fall + quarter) <= ridge * ridge * corner.square;
        let dip = if least >= self.tilt_slack || is_shallow {
            Dip::Nowhere
        } else if across >= self.tilt_slack {
            Dip::Edge(index)
        } else if along >= self.tilt_slack {
            Dip::Edge(before(index))
        } else {
            Dip::Anywhere
        };
        let low = if least >= self.tilt_slack { corner.square - self.tilt_slack } else { low };
        Ok(Seen { corner, index, low, dip })
    }

    /// Whether the axis is on the inner side of a triangle of a closed surface, wherever it is closest to the triangle. No
    /// contact is there: if the closest point is on an edge, and the axis outside, it is above the edge's other triangle.
    ///
    /// Above a point that moves along a line, the closest point of the axis moves one way. So it is nowhere higher above
    /// the triangle than above one of the corners.
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

    /// Whether no vertex next to a triangle's lowest corner is lower, and no triangle around it is known to have been
    /// visited. `None` without budget.
    fn is_low(
        &mut self,
        triangle: u32,
        seen: &Seen,
        heights: &mut Heights,
    ) -> Result<Option<bool>, QueryError> {
        let lowest = seen.corner.vertex;
        if heights.is_settled(lowest) {
            return Ok(Some(false));
        }
        let tree = self.tree;
        let (mut row, mut corner, mut is_back) = (triangle, seen.index, false);
        for _ in 0..MAX_RING {
            let edge = if is_back { before(corner) } else { corner };
            let Some((next, other)) = tree.across(row, edge) else {
                // At a border: from the first triangle the other way.
                if is_back {
                    break;
                }
                (row, corner, is_back) = (triangle, seen.index, true);
                continue;
            };
            if next == triangle {
                break;
            }
            let Some(left) = self.left.node_tests.checked_sub(1) else { return Ok(None) };
            self.left.node_tests = left;
            (row, corner) = (next, if is_back { other } else { after(other) });
            let new = if is_back { before(corner) } else { after(corner) };
            if self.corner(row, new, heights)?.is_below(seen.corner) {
                heights.settle(lowest);
                return Ok(Some(false));
            }
        }
        heights.settle(lowest);
        Ok(Some(true))
    }

    /// Whether the vertex beyond an edge is not lower than the triangle. `None` without budget.
    fn dips(
        &mut self,
        triangle: u32,
        edge: u32,
        low: f32,
        heights: &mut Heights,
    ) -> Result<Option<bool>, QueryError> {
        let Some((row, other)) = self.tree.across(triangle, edge) else { return Ok(Some(true)) };
        let Some(left) = self.left.node_tests.checked_sub(1) else { return Ok(None) };
        self.left.node_tests = left;
        let beyond = self.corner(row, before(other), heights)?;
        Ok(Some(!(beyond.square < low)))
    }

    /// A triangle's corner.
    fn corner(
        &self,
        triangle: u32,
        index: u32,
        heights: &mut Heights,
    ) -> Result<Corner, QueryError> {
        let corrupt = QueryError::Corrupt { row: triangle };
        let rows = self.tree.triangle(triangle).ok_or(corrupt)?;
        let &vertex = rows.get(index as usize).ok_or(corrupt)?;
        let (square, _) = self.height(heights, vertex)?;
        Ok(Corner { square, vertex })
    }
}

/// The corner after one, or the edge.
const fn after(corner: u32) -> u32 {
    if corner == 2 { 0 } else { corner + 1 }
}

/// The corner before one, or the edge.
const fn before(corner: u32) -> u32 {
    if corner == 0 { 2 } else { corner - 1 }
}

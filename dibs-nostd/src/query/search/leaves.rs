//! The search for the leaves around a point of the axis, and in them.
//!
//! A search that goes farther than the closest triangle gathers them, each with a bound. The next ticks look only at those
//! whose bounds have run out.
//!
//! Rounding. A bound is stored less the slack of its own search, and compared with the cutoff, which has the slack of this
//! one.

use super::{Search, THIRD, Waiting};
use crate::math::sqrt::sqrt;
use crate::query::memory::leaves::{Leaf, Leaves};
use crate::query::plane::{Plane, least};
use crate::tree::format::Link;
use crate::unavailable::QueryError;
use crate::{Index, Proximity, Tool, VertexTable};

/// A search goes as much farther as tool and surface move in so many ticks, but not more than twice as far, and less where
/// there are too many leaves.
const TICKS: f32 = 60.0;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Whether the leaves hold the closest triangle. The search's point is as far as `way` from theirs.
    pub fn is_among(&self, leaves: &Leaves, way: f32) -> bool {
        leaves.has_all(self.cutoff + self.coordinate_slack, leaves.moved(way))
    }

    /// Searches these leaves alone.
    pub fn among(mut self, leaves: &mut Leaves, way: f32) -> Result<Proximity, QueryError> {
        let moved = leaves.moved(way);
        let slack = self.slack + self.coordinate_slack;
        let (leaves, moved_before) = leaves.each();
        for leaf in leaves {
            if leaf.bound - moved > self.cutoff + self.coordinate_slack {
                continue;
            }
            let Link::Leaf { first, count } = Link::decode(leaf.link) else {
                return Err(QueryError::Corrupt { row: leaf.link });
            };
            let Some(bound) = self.leaf_bound(first, count)? else { return self.finish(0.0) };
            let bound = (bound - slack - way + moved_before) * (1.0 - f32::EPSILON);
            if bound > leaf.bound {
                leaf.bound = bound;
            }
        }
        self.finish(f32::INFINITY)
    }

    /// Searches the tree, and gathers the leaves around the point.
    pub fn gather(mut self, leaves: &mut Leaves) -> Result<Proximity, QueryError> {
        leaves.forget();
        let slack = self.slack + self.coordinate_slack;
        let mut wider = TICKS * leaves.step();
        if wider > self.cutoff {
            wider = self.cutoff;
        }
        while let Some(top) = self.waiting.checked_sub(1) {
            self.waiting = top;
            let &Waiting { lower, link } =
                self.stack.get(top).ok_or(QueryError::Corrupt { row: top as u32 })?;
            if lower > self.cutoff + wider {
                continue;
            }
            let (first, count) = match Link::decode(link) {
                Link::Leaf { first, count } => (first, count),
                Link::Children { first, count } => {
                    if !self.wait_for(lower, first, count, wider)? {
                        return self.finish(0.0);
                    }
                    continue;
                }
            };
            let Some(own) = self.leaf_bound(first, count)? else { return self.finish(0.0) };
            let bound = (if own > lower { own } else { lower }) - slack;
            if leaves.is_full() {
                wider *= 0.5;
                leaves.keep_within(self.cutoff + wider - slack);
            }
            if !(bound > self.cutoff + wider - slack) {
                leaves.push(Leaf { link, bound });
            }
        }
        let found = self.finish(f32::INFINITY)?;
        leaves.close(found.axis_distance + wider - 2.0 * slack);
        Ok(found)
    }

    /// Tests the spheres of a node's children. Returns whether the budget was enough.
    fn wait_for(
        &mut self,
        parent: f32,
        first: u32,
        count: u32,
        wider: f32,
    ) -> Result<bool, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let Some(left) = self.left.node_tests.checked_sub(count) else { return Ok(false) };
        self.left.node_tests = left;
        let (base, tree) = (self.waiting, self.tree);
        for node in tree.records(first, count).ok_or(corrupt)? {
            let distance = sqrt(self.tool.axis_distance_squared(self.position(node.pin)?));
            let own = distance - node.radius_code as f32 * self.radius_scale;
            // A NaN counts as near: the leaves below name the vertex that it comes from.
            if own > self.cutoff + wider {
                continue;
            }
            self.lower_cutoff_to_pin(node.pin, distance);
            let lower = if own > parent { own } else { parent };
            self.push(base, Waiting { lower, link: node.link }).ok_or(corrupt)?;
        }
        Ok(true)
    }

    /// Tests a leaf; a lower bound on its distance, or `None` out of budget.
    fn leaf_bound(&mut self, first: u32, count: u32) -> Result<Option<f32>, QueryError> {
        let Some(left) = self.left.node_tests.checked_sub(1) else { return Ok(None) };
        self.left.node_tests = left;
        let corrupt = QueryError::Corrupt { row: first };
        let [corner, ..] = self.tree.triangle(first).ok_or(corrupt)?;
        let position = self.position(corner)?;
        let normal = self.tool.axis_to(position);
        let length = sqrt(normal.dot(normal));
        let plane = self.plane_across(normal, position, length);
        let excess = plane.excess(self.tree, self.vertices, first, count).ok_or(corrupt)?;
        if excess > 0.0 {
            return Ok(Some(self.cutoff + excess / length));
        }
        let mut bound = f32::INFINITY;
        for (triangle, corners) in (first..).zip(self.tree.triangles(first, count).ok_or(corrupt)?)
        {
            let Some(own) = self.triangle_bound(triangle, corners, &plane, length)? else {
                return Ok(None);
            };
            if own < bound {
                bound = own;
            }
        }
        Ok(Some(bound))
    }

    /// Tests a triangle against its leaf's plane, whose normal is `length` long, against one of its own, and exactly; a
    /// lower bound on its distance, or `None` out of budget.
    #[inline(always)]
    fn triangle_bound(
        &mut self,
        triangle: u32,
        corners: [u32; 3],
        leaf_plane: &Plane,
        length: f32,
    ) -> Result<Option<f32>, QueryError> {
        if triangle == self.best_triangle {
            return Ok(Some(sqrt(self.best_squared)));
        }
        let (Some(left), Some(triangles_left)) =
            (self.left.node_tests.checked_sub(1), self.left.triangle_tests.checked_sub(1))
        else {
            return Ok(None);
        };
        self.left.node_tests = left;
        let [a, b, c] = corners;
        let corners = [self.position(a)?, self.position(b)?, self.position(c)?];
        let excess = |plane: &Plane| least(corners.map(|at| plane.normal.dot(at))) - plane.limit;
        let from_leaf = excess(leaf_plane);
        if from_leaf > 0.0 {
            return Ok(Some(self.cutoff + from_leaf / length));
        }
        let [a, b, c] = corners;
        let middle = (a + b + c) * THIRD;
        let normal = self.tool.axis_to(middle);
        let length = sqrt(normal.dot(normal));
        let plane = self.plane_across(normal, middle, length);
        if plane.limit.is_nan() {
            return Err(QueryError::Position { vertex: self.not_finite(triangle) });
        }
        let own = excess(&plane);
        if own > 0.0 {
            return Ok(Some(self.cutoff + own / length));
        }
        self.left.triangle_tests = triangles_left;
        let Some(pair) = self.tool.closest_on_triangle(&corners, f32::INFINITY) else {
            return Err(QueryError::Position { vertex: self.not_finite(triangle) });
        };
        let distance = sqrt(pair.distance_squared);
        if pair.distance_squared < self.best_squared {
            self.improve(triangle, pair, distance);
        }
        self.add_tie(triangle, pair.distance_squared);
        Ok(Some(distance))
    }
}

//! The search for the leaves around a point of the axis, and in them.
//!
//! A search that goes farther than the closest triangle gathers them, each with a bound. The next ticks look only at those
//! whose bounds have run out.
//!
//! Rounding. A bound is stored less the slack of its own search, and compared with the cutoff, which has the slack of this
//! one.

use super::node::AROUND;
use super::{Search, Waiting};
use crate::math::sqrt::sqrt;
use crate::query::memory::leaves::{Leaf, Leaves};
use crate::query::plane::least;
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
        while let Some(Waiting { lower, link }) = self.pop() {
            if lower > self.cutoff + wider {
                continue;
            }
            let (first, count) = match Link::decode(link) {
                Link::Leaf { first, count } => (first, count),
                Link::Children { first, count } => {
                    if self.meter.nodes(count).is_none() {
                        return self.finish(0.0);
                    }
                    self.expand::<AROUND>(lower, first, count, wider)?;
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

    /// Tests a leaf; a lower bound on its distance, or `None` out of budget.
    fn leaf_bound(&mut self, first: u32, count: u32) -> Result<Option<f32>, QueryError> {
        if self.meter.node().is_none() {
            return Ok(None);
        }
        let corrupt = QueryError::Corrupt { row: first };
        let [corner, ..] = self.tree.triangle(first).ok_or(corrupt)?;
        let plane = self.plane_towards(self.position(corner)?);
        let length = sqrt(plane.normal.dot(plane.normal));
        let excess = plane.excess(self.tree, self.vertices, first, count).ok_or(corrupt)?;
        if excess > 0.0 {
            return Ok(Some(self.cutoff + excess / length));
        }
        let mut bound = f32::INFINITY;
        for triangle in first..first.saturating_add(count) {
            let own = if triangle == self.best_triangle {
                sqrt(self.best_squared)
            } else if self.meter.triangle_plane().is_some() {
                let corners = self.corners(triangle)?;
                let from_leaf = least(corners.map(|at| plane.normal.dot(at))) - plane.limit;
                if from_leaf > 0.0 {
                    self.cutoff + from_leaf / length
                } else {
                    self.bound_triangle(triangle, &corners)?.0
                }
            } else {
                return Ok(None);
            };
            if own < bound {
                bound = own;
            }
        }
        Ok(Some(bound))
    }
}

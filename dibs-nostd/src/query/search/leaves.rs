//! The search for the leaves around a point of the axis, and the search within them.
//!
//! A search that goes farther than the closest triangle collects these leaves, each with a bound. The next ticks test
//! only leaves whose bounds have run out.
//!
//! Rounding. A bound is stored minus the slack of its own search, and compared with a cutoff that includes the slack of
//! the current search.

// Requirements: S-03, T-01

use heapless::VecView;

use super::node::AROUND;
use super::{Search, WaitingNode};
use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::query::memory::leaves::{Leaf, Leaves};
use crate::query::plane::least;
use crate::query::prices::LEAF_PLANE;
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Index, Proximity, Tool, VertexTable};

/// A search goes farther by the motion of tool and surface in so many ticks, to at most twice the distance, and less if
/// there are too many leaves.
const TICKS: f32 = 60.0;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Whether the leaves contain the closest triangle. The search's point is `distance` (mm) from the leaves' point.
    pub fn is_among(&self, leaves: &Leaves, distance: f32) -> bool {
        leaves.has_all(self.cutoff + self.coordinate_slack, leaves.moved(distance))
    }

    /// Searches only these leaves.
    pub fn among(
        mut self,
        leaves: &mut Leaves,
        distance: f32,
        is_priced: bool,
    ) -> Result<Proximity, QueryError> {
        let price = if is_priced { 1 + LEAF_PLANE } else { 1 };
        let moved = leaves.moved(distance);
        let slack = self.slack + self.coordinate_slack;
        let (leaves, moved_before) = leaves.each();
        for leaf in leaves {
            if leaf.bound - moved > self.cutoff + self.coordinate_slack {
                continue;
            }
            let NodeLink::Leaf { first, count } = NodeLink::decode(leaf.link) else {
                return Err(QueryError::Corrupt { row: leaf.link });
            };
            let Some(bound) = self.leaf_bound(first, count, price)? else {
                return self.finish(0.0);
            };
            let bound = (bound - slack - distance + moved_before) * (1.0 - f32::EPSILON);
            if bound > leaf.bound {
                leaf.bound = bound;
            }
        }
        self.finish(f32::INFINITY)
    }

    /// Searches the tree and collects the leaves around the point; if the budget ends, the remaining subtrees wait for
    /// the next call. A search that took several calls gives no answer itself, but leaves that contain it.
    #[cold] // About once in sixty ticks.
    #[inline(never)]
    pub fn gather(
        mut self,
        leaves: &mut Leaves,
        waiting: &mut VecView<WaitingNode>,
        is_priced: bool,
    ) -> Result<Proximity, QueryError> {
        let price = if is_priced { 1 + LEAF_PLANE } else { 1 };
        let is_first = waiting.is_empty();
        if is_first {
            leaves.begin();
        } else {
            self.resume(leaves, waiting)?;
        }
        let slack = self.slack + self.coordinate_slack;
        let mut wider = TICKS * leaves.step();
        if wider > self.cutoff {
            wider = self.cutoff;
        }
        while let Some(WaitingNode { lower, link }) = self.pop() {
            if lower > self.cutoff + wider {
                continue;
            }
            let (first, count) = match NodeLink::decode(link) {
                NodeLink::Leaf { first, count } => (first, count),
                NodeLink::Children { first, count } => {
                    if self.meter.nodes(count).is_none() {
                        return self.leave(WaitingNode { lower, link }, wider, leaves, waiting);
                    }
                    self.expand::<AROUND>(lower, first, count, wider)?;
                    continue;
                }
            };
            let Some(own) = self.leaf_bound(first, count, price)? else {
                return self.leave(WaitingNode { lower, link }, wider, leaves, waiting);
            };
            let bound = larger(lower, own) - slack;
            if leaves.is_full() {
                wider *= 0.5;
                leaves.keep_within(leaves.then(self.cutoff + wider - slack));
            }
            if !(bound > self.cutoff + wider - slack) {
                leaves.push(Leaf { link, bound: leaves.then(bound) });
            }
        }
        let found = self.finish(if is_first { f32::INFINITY } else { 0.0 })?;
        leaves.pass(found.axis_distance + wider);
        leaves.close(2.0 * slack);
        Ok(found)
    }

    /// Continues with the waiting subtrees.
    #[cold]
    fn resume(
        &mut self,
        leaves: &Leaves,
        waiting: &mut VecView<WaitingNode>,
    ) -> Result<(), QueryError> {
        let moved = leaves.moved(0.0);
        self.waiting = 0;
        for &WaitingNode { lower, link } in waiting.iter() {
            let lower = lower - moved;
            let lower = lower - lower.abs() * f32::EPSILON;
            self.push(self.waiting, WaitingNode { lower, link })
                .ok_or(QueryError::Corrupt { row: 0 })?;
        }
        waiting.clear();
        Ok(())
    }

    /// Keeps the remaining subtrees for another call.
    #[cold]
    fn leave(
        &mut self,
        unfinished: WaitingNode,
        wider: f32,
        leaves: &mut Leaves,
        waiting: &mut VecView<WaitingNode>,
    ) -> Result<Proximity, QueryError> {
        leaves.pass(self.cutoff - self.slack + wider);
        let rest = self.stack.iter().take(self.waiting).chain([&unfinished]);
        // A loop over a chain has two entries, which no proof of its turns takes.
        rest.for_each(|&WaitingNode { lower, link }| {
            // It has as much room as the stack.
            let _ = waiting.push(WaitingNode { lower: leaves.then(lower), link });
        });
        self.finish(0.0)
    }

    /// Tests a leaf, whose plane counts as `price` node tests. Returns a lower bound on its distance, or `None` if out of
    /// budget.
    fn leaf_bound(
        &mut self,
        first: u32,
        count: u32,
        price: u32,
    ) -> Result<Option<f32>, QueryError> {
        if self.meter.nodes(price).is_none() {
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

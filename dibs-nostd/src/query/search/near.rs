//! All low triangles within a distance, instead of the closest.

use super::heights::{Heights, Place};
use super::low::MAX_RING;
use super::{Search, Waiting};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPair, Tool};
use crate::tree::format::Link;
use crate::unavailable::QueryError;
use crate::{Budget, Index, Options, VertexTable};

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// A search over a range, with the budget of `options`.
    ///
    /// In a sound tree it tests each node's sphere once. It looks at each triangle once, at the vertex beyond one edge of
    /// it, and at its side. Each triangle stands for one vertex at most, and has it turned round once, past [`MAX_RING`]
    /// triangles at most. So this bound is never met; if corrupt bytes form a loop, it ends the search.
    pub fn over_range(mut self, options: &Options) -> Self {
        let header = self.tree.header();
        let most = header.triangles.saturating_mul(3 + MAX_RING).saturating_add(header.nodes);
        self.budget = options.budget.nodes_at_most(most);
        self.left = self.budget;
        self
    }

    /// Visits every triangle within `limit` of the axis that may be the lowest of its surroundings, but for ridges of
    /// `ridge`, with its pair. A visit returns the next limit. Unvisited ones are at least as far as
    /// the distance returned; the budget is the tests made. With a label, only that `part` of the surface is visited.
    pub fn each_low(
        mut self,
        limit: f32,
        (ridge, part): (f32, Option<u8>),
        mut visit: impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<(f32, Budget), QueryError> {
        self.set_limit(limit);
        let mut heights = Heights::new(part);
        let least = match self.visit_waiting(ridge, &mut heights, &mut visit)? {
            Some(waiting) => {
                let standing = least_standing(&heights, ridge);
                if standing < waiting { standing } else { waiting }
            }
            None if self.visit_rest(&heights, &mut visit)? => f32::INFINITY,
            None => least_standing(&heights, ridge),
        };
        Ok((least, self.made()))
    }

    /// Visits the triangles of the waiting subtrees. Returns a lower bound on the distance of the rest if the budget was not
    /// enough.
    #[inline(always)]
    pub(super) fn visit_waiting(
        &mut self,
        ridge: f32,
        heights: &mut Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<Option<f32>, QueryError> {
        while let Some(top) = self.waiting.checked_sub(1) {
            self.waiting = top;
            let &Waiting { lower, link } =
                self.stack.get(top).ok_or(QueryError::Corrupt { row: top as u32 })?;
            if lower > self.cutoff {
                continue;
            }
            let (first, count, is_leaf) = match Link::decode(link) {
                Link::Children { first, count } => (first, count, false),
                Link::Leaf { first, count } => (first, count, true),
            };
            let mut is_done = false;
            if let Some(left) = self.left.node_tests.checked_sub(count) {
                self.left.node_tests = left;
                is_done = if is_leaf {
                    self.visit_low(first, count, ridge, heights, visit)?.is_some()
                } else {
                    self.wait_for_children(lower, first, count)?;
                    true
                };
            }
            if !is_done {
                return Ok(Some(self.least_waiting(lower)));
            }
        }
        Ok(None)
    }

    /// Visits the triangles that still stand for a vertex. Returns whether the budget was enough.
    #[inline(always)]
    pub(super) fn visit_rest(
        &mut self,
        heights: &Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        for place in Place::all() {
            let vertex = heights.at(place);
            if vertex.standing().is_some() && !self.visit_standing(vertex, heights, visit)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The tests made so far.
    pub(super) fn made(&self) -> Budget {
        self.budget.less(self.left.node_tests, self.left.triangle_tests)
    }

    pub(super) fn set_limit(&mut self, limit: f32) {
        self.cutoff = limit + self.slack;
        self.cutoff_squared = self.cutoff * self.cutoff;
    }

    pub(super) fn wait_for_children(
        &mut self,
        parent: f32,
        first: u32,
        count: u32,
    ) -> Result<(), QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let tree = self.tree;
        let base = self.waiting;
        for node in tree.records(first, count).ok_or(corrupt)? {
            let position = self.position(node.pin)?;
            let radius = node.radius_code as f32 * self.radius_scale;
            let normal = self.tool.axis_to(position);
            let squared = normal.dot(normal);
            let far = self.cutoff + radius;
            // A NaN counts as near: the leaves below name the vertex that it comes from.
            if squared > far * far {
                continue;
            }
            let distance = sqrt(squared);
            // The plane goes through the pin: it rejects no leaf whose pin is within the cutoff.
            if squared > self.cutoff_squared
                && let Link::Leaf { first, count } = Link::decode(node.link)
            {
                let plane = self.plane_across(normal, position, distance);
                if plane.beyond(tree, self.vertices, first, count).ok_or(corrupt)? == count {
                    continue;
                }
            }
            let own = distance - radius;
            let lower = if own > parent { own } else { parent };
            self.push(base, Waiting { lower, link: node.link }).ok_or(corrupt)?;
        }
        Ok(())
    }
}

/// Lower bound on the distances of the triangles that stand for a vertex: they dip below it by half a ridge at most.
pub(super) fn least_standing(heights: &Heights, ridge: f32) -> f32 {
    sqrt(heights.least_standing()) - 0.5 * ridge
}

//! The range search that continues from the front of the last one; for rounding see [`tick`](super::tick).

// Requirements: S-04, T-01

#[cfg(test)]
mod tests;

use super::heights::Heights;
use super::near::least_candidate;
use super::{Search, WaitingNode};
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::query::Options;
use crate::query::made::Tests;
use crate::query::memory::clock::Deadline;
use crate::query::memory::range::{RangeFrontMut, RangeNode};
use crate::query::prices::{CHILD_PLANE, LIST, PASSED, VISIT};
use crate::tool::{AxisPair, Tool};
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// As [`each_low`](Self::each_low), continuing from the front of the last search. Nodes without a free slot are
    /// searched from the stack.
    pub fn each_low_from(
        mut self,
        front: &mut RangeFrontMut<'_>,
        limit: f32,
        (prominence, options): (f32, &Options),
        mut visit: impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<(f32, Tests), QueryError> {
        self.set_limit(limit);
        if front.is_empty() && front.start(self.tree.roots()).is_none() {
            return self.each_low(limit, (prominence, options), visit);
        }
        self.waiting = 0;
        if self.pay(options.is_priced, LIST + front.opened() / PASSED).is_none() {
            return Ok((0.0, self.meter.made()));
        }
        let mut heights = Heights::new(options);
        let mut threshold = front.clock.within(self.cutoff + self.coordinate_slack);
        let mut at = 0;
        while let Some(node) = front.node(at) {
            let is_due = !threshold.is_before(node.deadline);
            if !is_due && node.near == 0 {
                at += 1;
                continue;
            }
            let is_done = (!is_due || self.test_farther(front, at, node, heights.is_priced)?)
                && self.visit_waiting(prominence, &mut heights, &mut visit)?.is_none()
                && self.visit_near(front, at, prominence, &mut heights, &mut visit)?;
            if !is_done {
                break;
            }
            // A visit may have lowered the cutoff.
            threshold = front.clock.within(self.cutoff + self.coordinate_slack);
            at += 1;
        }
        if front.node(at).is_some() || !self.visit_rest(&heights, &mut visit)? {
            let (beyond, candidate) =
                (self.least_from(front, at)?, least_candidate(&heights, prominence));
            let least = smaller(beyond, candidate);
            return Ok((least, self.meter.made()));
        }
        Ok((f32::INFINITY, self.meter.made()))
    }

    /// Tests the children that were beyond the range. Those without a free slot go on the stack. Returns `false` if the
    /// budget ran out.
    #[inline(always)]
    fn test_farther(
        &mut self,
        front: &mut RangeFrontMut<'_>,
        at: usize,
        node: RangeNode,
        is_priced: bool,
    ) -> Result<bool, QueryError> {
        let (clock, tree) = (front.clock, self.tree);
        let margin = self.slack + self.coordinate_slack;
        let later = |bound: f32| node.deadline.or_later(clock.deadline(bound - margin));
        let RangeNode { link, mut opened, mut near, .. } = node;
        let NodeLink::Children { first, count } = NodeLink::decode(link) else {
            return Err(QueryError::Corrupt { row: 0 });
        };
        let corrupt = QueryError::Corrupt { row: first };
        if self.pay(is_priced, VISIT).is_none() {
            return Ok(false);
        }
        let mut first_due = clock.never();
        for (slot, child) in tree.records(first, count).ok_or(corrupt)?.enumerate() {
            let bit = 1 << slot;
            if (opened | near) & bit != 0 {
                continue;
            }
            if self.meter.node().is_none() {
                // The remaining children stay due.
                let deadline = node.deadline;
                *front.node_mut(at).ok_or(corrupt)? = RangeNode { link, deadline, opened, near };
                return Ok(false);
            }
            let (position, normal, distance, own) = self.child(&child)?;
            let mut deadline = later(own);
            // NaN counts as near: the leaves below report the vertex that it comes from.
            if !(own > self.cutoff) {
                match NodeLink::decode(child.link) {
                    NodeLink::Children { .. } => {
                        if front.open(child.link, deadline).is_some() {
                            opened |= bit;
                            continue;
                        }
                        let subtree = WaitingNode { lower: own, link: child.link };
                        self.push(0, subtree).ok_or(corrupt)?;
                    }
                    // Without a test of its plane it counts as near.
                    NodeLink::Leaf { .. } if self.pay(is_priced, 1 + CHILD_PLANE).is_none() => {
                        near |= bit;
                        continue;
                    }
                    NodeLink::Leaf { first, count } => {
                        let plane = self.plane_across(normal, position, distance);
                        let excess =
                            plane.excess(tree, self.vertices, first, count).ok_or(corrupt)?;
                        if !(excess > 0.0) {
                            near |= bit;
                            continue;
                        }
                        deadline = later(self.cutoff + excess / distance);
                    }
                }
            }
            if deadline.is_before(first_due) {
                first_due = deadline;
            }
        }
        let deadline = first_due;
        *front.node_mut(at).ok_or(corrupt)? = RangeNode { link, deadline, opened, near };
        Ok(true)
    }

    /// Visits the leaves of an opened node within the range. Returns `false` if the budget ran out.
    #[inline(always)]
    fn visit_near(
        &mut self,
        front: &mut RangeFrontMut<'_>,
        at: usize,
        prominence: f32,
        heights: &mut Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        let (clock, tree) = (front.clock, self.tree);
        let margin = self.slack + self.coordinate_slack;
        let corrupt = QueryError::Corrupt { row: 0 };
        let node = front.node_mut(at).ok_or(corrupt)?;
        let NodeLink::Children { first, .. } = NodeLink::decode(node.link) else {
            return Err(corrupt);
        };
        let mut near = node.near;
        while near != 0 {
            let slot = near.trailing_zeros();
            near &= near - 1;
            let child = tree.whole_record(first + slot).ok_or(corrupt)?;
            let NodeLink::Leaf { first, count } = NodeLink::decode(child.link) else {
                return Err(corrupt);
            };
            if self.meter.nodes(heights.price_of(count)).is_none() {
                return Ok(false);
            }
            let Some(low) = self.visit_low(first, count, prominence, heights, visit)? else {
                return Ok(false);
            };
            if low > self.cutoff_squared {
                let deadline = clock.deadline(sqrt(low) - margin);
                node.near &= !(1 << slot);
                if deadline.is_before(node.deadline) {
                    node.deadline = deadline;
                }
            }
        }
        Ok(true)
    }

    /// Lower bound on the distances of everything unvisited below the opened nodes from a slot on.
    #[cold]
    fn least_from(&self, front: &RangeFrontMut<'_>, from: usize) -> Result<f32, QueryError> {
        let mut least = f32::INFINITY;
        let mut first_due: Option<Deadline> = None;
        let add = |least: &mut f32, bound: f32| {
            // NaN or below zero: no bound.
            let bound = larger(0.0, bound);
            if bound < *least {
                *least = bound;
            }
        };
        for node in front.rest(from) {
            if first_due.is_none_or(|due| node.deadline.is_before(due)) {
                first_due = Some(node.deadline);
            }
            if node.near == 0 {
                continue;
            }
            let NodeLink::Children { first, count } = NodeLink::decode(node.link) else { continue };
            let corrupt = QueryError::Corrupt { row: first };
            let children = self.tree.records(first, count).ok_or(corrupt)?;
            for (_, child) in children.enumerate().filter(|(slot, _)| node.near >> slot & 1 == 1) {
                let distance = sqrt(self.tool.axis_distance_squared(self.position(child.pin)?));
                add(&mut least, distance - child.radius_code as f32 * self.radius_scale);
            }
        }
        if let Some(due) = first_due {
            add(&mut least, front.clock.left(due));
        }
        Ok(least)
    }
}

//! The front of a range search, kept from tick to tick.
//!
//! It has the nodes that were opened. Of their children some are opened themselves, some are leaves within the range, and
//! the others are farther: one bound for those of a node runs out by an odometer, as in a tracker's front (see
//! [`tick`](super::tick), also for rounding). Leaves within the range are looked at in every tick, all others once the
//! bound has run out. Nodes that were opened stay so until no place is left; then the front starts anew.

#[cfg(test)]
mod tests;

use super::heights::Heights;
use super::near::least_standing;
use super::{Search, Waiting};
use crate::math::sqrt::sqrt;
use crate::query::axis::Axis;
use crate::query::tracker::front::is_before;
use crate::surface::motion::{FAR, Unit};
use crate::tool::{AxisPair, Tool};
use crate::tree::format::{Link, MAX_CHILDREN};
use crate::unavailable::QueryError;
use crate::{Budget, Index, Travel, VertexTable};

/// After a motion of more units, a 16th to a 32nd of the root sphere's radius, the front starts anew.
const JUMP: u64 = 1 << 20;

/// A node whose children are apart.
#[derive(Clone, Copy, Debug)]
struct Opened {
    /// Its children, as a link.
    link: u32,
    /// The odometer's reading at which the least bound of those that are farther has come down to zero.
    key: u32,
    /// Children that are opened, a bit each.
    opened: u8,
    /// Leaves that neither their sphere nor their plane has rejected, a bit each.
    near: u8,
}

/// The opened nodes, at most `M`.
#[derive(Clone, Debug)]
pub(in crate::query) struct RangeFront<const M: usize> {
    nodes: [Opened; M],
    state: State,
}

#[derive(Clone, Debug)]
struct State {
    count: usize,
    /// The odometer: units that tool and surface have moved; wraps.
    now: u32,
    /// Axis and surface at the last search; none if it did not come to its end.
    last: Option<(Axis, Travel)>,
    /// The label whose leaves are near.
    part: Option<u8>,
}

/// The front without its size.
pub(in crate::query) struct RangeFrontMut<'f> {
    nodes: &'f mut [Opened],
    state: &'f mut State,
    unit: Unit,
}

impl<const M: usize> RangeFront<M> {
    pub const fn new() -> Self {
        let none = Opened { link: 0, key: 0, opened: 0, near: 0 };
        Self { nodes: [none; M], state: State { count: 0, now: 0, last: None, part: None } }
    }

    /// Number of opened nodes.
    pub const fn opened(&self) -> u32 {
        self.state.count as u32
    }

    /// The front after the motion since its last search.
    pub fn moved_to(
        &mut self,
        tool: &impl Tool,
        travel: Travel,
        unit: Unit,
        part: Option<u8>,
    ) -> RangeFrontMut<'_> {
        let Self { nodes, state } = self;
        let last = state.last.filter(|_| state.part == part);
        let moved = last.and_then(|(axis, before)| {
            let surface = travel.since(&before)?;
            Some(surface.saturating_add(u64::from(axis.step(tool, unit))))
        });
        match moved {
            Some(moved) if moved <= JUMP && state.count < M => {
                state.now = state.now.wrapping_add(moved as u32);
            }
            _ => state.count = 0,
        }
        (state.last, state.part) = (None, part);
        RangeFrontMut { nodes, state, unit }
    }
}

impl RangeFrontMut<'_> {
    /// The search has come to its end.
    pub fn keep(&mut self, tool: &impl Tool, travel: Travel) {
        self.state.last = Some((Axis::of(tool), travel));
    }

    fn open(&mut self, link: u32, key: u32) -> Option<()> {
        *self.nodes.get_mut(self.state.count)? = Opened { link, key, opened: 0, near: 0 };
        self.state.count += 1;
        Some(())
    }

    /// Opens the whole tree, if nothing is opened.
    fn start(&mut self, roots: u32) -> Option<()> {
        for first in (0..roots).step_by(MAX_CHILDREN as usize) {
            let rest = roots - first;
            let count = if rest < MAX_CHILDREN { rest } else { MAX_CHILDREN };
            self.open(Link::Children { first, count }.encode(), self.state.now)?;
        }
        Some(())
    }

    /// A bound whose key is not beyond this is less than a distance.
    #[inline(always)]
    fn threshold(&self, distance: f32) -> u32 {
        self.state.now.wrapping_add(self.unit.up(distance))
    }

    #[inline(always)]
    fn node(&self, at: usize) -> Option<Opened> {
        if at < self.state.count { self.nodes.get(at).copied() } else { None }
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// As [`each_low`](Self::each_low), from the front of the last search on. Nodes for which there is no place are searched
    /// without.
    pub fn each_low_from(
        mut self,
        front: &mut RangeFrontMut<'_>,
        limit: f32,
        (ridge, part): (f32, Option<u8>),
        mut visit: impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<(f32, Budget), QueryError> {
        self.set_limit(limit);
        if front.state.count == 0 && front.start(self.tree.roots()).is_none() {
            return self.each_low(limit, (ridge, part), visit);
        }
        self.waiting = 0;
        let mut heights = Heights::new(part);
        let mut threshold = front.threshold(self.cutoff + self.coordinate_slack);
        let mut at = 0;
        while let Some(node) = front.node(at) {
            let is_due = !is_before(threshold, node.key);
            if !is_due && node.near == 0 {
                at += 1;
                continue;
            }
            let is_done = (!is_due || self.look_farther(front, at, node)?)
                && self.visit_waiting(ridge, &mut heights, &mut visit)?.is_none()
                && self.visit_near(front, at, ridge, &mut heights, &mut visit)?;
            if !is_done {
                break;
            }
            // A visit may have lowered the cutoff.
            threshold = front.threshold(self.cutoff + self.coordinate_slack);
            at += 1;
        }
        if at < front.state.count || !self.visit_rest(&heights, &mut visit)? {
            let (beyond, standing) = (self.least_from(front, at)?, least_standing(&heights, ridge));
            let least = if standing < beyond { standing } else { beyond };
            return Ok((least, self.made()));
        }
        Ok((f32::INFINITY, self.made()))
    }

    /// Tests the children that were farther. Those for which there is no place wait on the stack. Returns whether the budget
    /// was enough.
    #[inline(always)]
    fn look_farther(
        &mut self,
        front: &mut RangeFrontMut<'_>,
        at: usize,
        node: Opened,
    ) -> Result<bool, QueryError> {
        let (now, unit, tree) = (front.state.now, front.unit, self.tree);
        let margin = self.slack + self.coordinate_slack;
        let later = |bound: f32| {
            let own = now.wrapping_add(unit.down(bound - margin));
            if is_before(node.key, own) { own } else { node.key }
        };
        let Opened { link, mut opened, mut near, .. } = node;
        let Link::Children { first, count } = Link::decode(link) else {
            return Err(QueryError::Corrupt { row: 0 });
        };
        let corrupt = QueryError::Corrupt { row: first };
        let mut least = now.wrapping_add(FAR as u32);
        for (slot, child) in tree.records(first, count).ok_or(corrupt)?.enumerate() {
            let bit = 1 << slot;
            if (opened | near) & bit != 0 {
                continue;
            }
            let Some(left) = self.left.node_tests.checked_sub(1) else {
                return Ok(false);
            };
            self.left.node_tests = left;
            let position = self.position(child.pin)?;
            let normal = self.tool.axis_to(position);
            let distance = sqrt(normal.dot(normal));
            let own = distance - child.radius_code as f32 * self.radius_scale;
            let mut key = later(own);
            // A NaN counts as near: the leaves below name the vertex that it comes from.
            if !(own > self.cutoff) {
                match Link::decode(child.link) {
                    Link::Children { .. } => {
                        if front.open(child.link, key).is_some() {
                            opened |= bit;
                            continue;
                        }
                        let subtree = Waiting { lower: own, link: child.link };
                        self.push(0, subtree).ok_or(corrupt)?;
                    }
                    Link::Leaf { first, count } => {
                        let plane = self.plane_across(normal, position, distance);
                        let excess =
                            plane.excess(tree, self.vertices, first, count).ok_or(corrupt)?;
                        if !(excess > 0.0) {
                            near |= bit;
                            continue;
                        }
                        key = later(self.cutoff + excess / distance);
                    }
                }
            }
            if is_before(key, least) {
                least = key;
            }
        }
        *front.nodes.get_mut(at).ok_or(corrupt)? = Opened { link, key: least, opened, near };
        Ok(true)
    }

    /// Visits the leaves of an opened node within the range. Returns whether the budget was enough.
    #[inline(always)]
    fn visit_near(
        &mut self,
        front: &mut RangeFrontMut<'_>,
        at: usize,
        ridge: f32,
        heights: &mut Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        let (now, unit, tree) = (front.state.now, front.unit, self.tree);
        let margin = self.slack + self.coordinate_slack;
        let corrupt = QueryError::Corrupt { row: 0 };
        let node = front.nodes.get_mut(at).ok_or(corrupt)?;
        let Link::Children { first, .. } = Link::decode(node.link) else { return Err(corrupt) };
        let mut near = node.near;
        while near != 0 {
            let slot = near.trailing_zeros();
            near &= near - 1;
            let child = tree.whole_record(first + slot).ok_or(corrupt)?;
            let Link::Leaf { first, count } = Link::decode(child.link) else {
                return Err(corrupt);
            };
            let Some(left) = self.left.node_tests.checked_sub(count) else { return Ok(false) };
            self.left.node_tests = left;
            let Some(low) = self.visit_low(first, count, ridge, heights, visit)? else {
                return Ok(false);
            };
            if low > self.cutoff_squared {
                let key = now.wrapping_add(unit.down(sqrt(low) - margin));
                node.near &= !(1 << slot);
                if is_before(key, node.key) {
                    node.key = key;
                }
            }
        }
        Ok(true)
    }

    /// Lower bound on the distances of all that is below the opened nodes from a place on, without what was visited.
    #[cold]
    fn least_from(&self, front: &RangeFrontMut<'_>, from: usize) -> Result<f32, QueryError> {
        let mut least = f32::INFINITY;
        let mut add = |bound: f32| {
            // Not a number, or below zero: no bound.
            let bound = if bound > 0.0 { bound } else { 0.0 };
            if bound < least {
                least = bound;
            }
        };
        for node in front.nodes.get(from..front.state.count).unwrap_or_default() {
            add(front.unit.length(node.key.wrapping_sub(front.state.now) as i32));
            let Link::Children { first, count } = Link::decode(node.link) else { continue };
            let corrupt = QueryError::Corrupt { row: first };
            let children = self.tree.records(first, count).ok_or(corrupt)?;
            for (_, child) in children.enumerate().filter(|(slot, _)| node.near >> slot & 1 == 1) {
                let distance = sqrt(self.tool.axis_distance_squared(self.position(child.pin)?));
                add(distance - child.radius_code as f32 * self.radius_scale);
            }
        }
        Ok(least)
    }
}

//! A search that starts from the front of the previous one, and tests only the bounds that have run out.
//!
//! A child is due again once its bound's deadline is not later than the cutoff's. The cutoff's deadline never moves
//! back while answers are exact, since a distance shrinks by no more than the clock counts.
//!
//! Rounding. A bound is stored minus the slack of its own search, and compared with a cutoff that includes the slack of
//! the current one: so both errors are covered at any scale. Both slacks include 16 * 2^-24 of the coordinates, since
//! each frame may round positions anew.

// Requirement: T-01

mod facing;

use glam::Vec3;

use facing::FacingPlane;

use super::{Expansion, Search, WaitingNode};
use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::query::Budget;
use crate::query::made::Tests;
use crate::query::memory::clock::{Deadline, MotionClock};
use crate::query::memory::front::{ChildSlot, FrontMut, NOWHERE, UNUSED};
use crate::query::prices::{CHILD_PLANE, TRIANGLE, VISIT};
use crate::surface::motion::FAR;
use crate::tree::format::{Node, NodeLink};
use crate::unavailable::QueryError;
use crate::{Index, Proximity, Tool, TriangleRow, VertexTable};

/// A motion of more units than this, at most a 64th of the root sphere's radius, may invalidate most of the front.
const LARGE_STEP: u32 = 1 << 18;

pub(in crate::query) enum Outcome {
    /// No unsearched part of the surface is closer to the axis than `lower`. `is_complete`: every due bound was tested;
    /// `restarted`: the front was restarted.
    Ended { lower: f32, is_complete: bool, restarted: bool },
    /// The front has no free slot; the tests made until then.
    Full { tests: Tests },
}

pub(in crate::query) struct Tick<'s, 't, 'f, I, V: ?Sized, T> {
    search: Search<'s, 't, I, V, T>,
    front: FrontMut<'f>,
    clock: MotionClock,
    /// Subtracted from a bound before it is stored.
    margin: f32,
    /// Distance from the axis beyond which the search does not go.
    limit: f32,
    facing: FacingPlane,
    /// Whether its [work besides tests](crate::query::prices) counts.
    is_priced: bool,
}

impl<'s, 't, 'f, I: Index, V: VertexTable + ?Sized, T: Tool> Tick<'s, 't, 'f, I, V, T> {
    /// A tick that searches for surface within `separation` (mm) of the tool.
    #[inline(always)]
    pub fn new(
        mut search: Search<'s, 't, I, V, T>,
        front: FrontMut<'f>,
        clock: MotionClock,
        (budget, is_priced): (Budget, bool),
        separation: f32,
    ) -> Self {
        // A tick tests each node's sphere, each leaf's plane and each triangle at most twice.
        let header = search.tree.header();
        let triangles = header.triangles.saturating_mul(1 + Budget::TRIANGLE);
        let most = header.nodes.saturating_add(triangles).saturating_mul(4);
        search.meter = search.meter.within(budget.at_most(most));
        let margin = search.slack + search.coordinate_slack;
        let limit =
            if separation < f32::INFINITY { search.limit_to(separation) } else { f32::INFINITY };
        let facing = FacingPlane::new(&search);
        Self { search, front, clock, margin, limit, facing, is_priced }
    }

    /// Tests the bounds that run out with a motion of `moved` units.
    #[inline(always)]
    pub fn run(&mut self, moved: u32) -> Result<Outcome, QueryError> {
        let corrupt = QueryError::Corrupt { row: 0 };
        self.search.waiting = 0;
        if self.search.best.is_none()
            && let Some(child) = self.front.best.take()
        {
            self.front.put_back(child).ok_or(corrupt)?;
        }
        let restarted =
            moved > LARGE_STEP && 2 * self.front.count_due(self.threshold()) > self.front.used();
        if restarted {
            self.front.clear();
        }
        if self.front.is_empty() {
            let now = self.clock.deadline(0.0);
            for row in 0..=self.search.tree.header().other_roots {
                let root = self.search.tree.record(row).ok_or(corrupt)?;
                let nowhere = ChildSlot { node: NOWHERE, slot: 0 };
                if self.front.open(root.link, nowhere, now).is_none() {
                    self.front.clear();
                    return Ok(Outcome::Full { tests: Tests::NONE });
                }
            }
        }
        // Nodes opened from here on are tested at once.
        let end = self.front.used();
        // Where the last tick's budget ended: nodes near the tool are due in every tick, and the others would never have
        // their turn.
        let first = usize::from(*self.front.resume).min(end);
        let (mut slots, mut before) = (first..end, Some(0..first));
        loop {
            let Some(at) = self.front.next_due(slots.clone(), self.threshold()) else {
                let Some(next) = before.take() else { break };
                slots = next;
                continue;
            };
            match self.visit(at as u16)? {
                Visit::Done => slots.start = at + 1,
                Visit::OutOfBudget => {
                    // A node that took a whole tick waits for its next turn.
                    *self.front.resume = (at as u16).saturating_add(u16::from(at == first));
                    self.put_back_waiting().ok_or(corrupt)?;
                    self.search.leave_unfinished();
                    let least = self.clock.left(self.front.first(&self.clock));
                    let lower = larger(0.0, least);
                    return Ok(Outcome::Ended { lower, is_complete: false, restarted });
                }
                Visit::Full => {
                    // The due bounds after this node would stay due, and the front full.
                    self.front.clear();
                    return Ok(Outcome::Full { tests: self.search.meter.made() });
                }
            }
        }
        *self.front.resume = 0;
        self.close_some(1)?;
        let is_beyond = self.limit < f32::INFINITY && self.search.is_beyond(self.limit);
        let lower = if is_beyond { self.limit } else { f32::INFINITY };
        Ok(Outcome::Ended { lower, is_complete: true, restarted })
    }

    /// The closest triangle, if one was tested.
    pub fn triangle(&self) -> Option<TriangleRow> {
        self.search.best.map(|_| TriangleRow(self.search.best_triangle))
    }

    /// A bound is due if its deadline is not later than this.
    #[inline(always)]
    fn threshold(&self) -> Deadline {
        self.clock.within(self.search.cutoff + self.search.coordinate_slack)
    }

    #[inline(always)]
    fn deadline(&self, bound: f32) -> Deadline {
        self.clock.deadline(bound - self.margin)
    }

    /// The answer. No unsearched part of the surface is closer to the axis than `lower`.
    #[inline(always)]
    pub fn finish(&mut self, lower: f32) -> Result<Proximity, QueryError> {
        if let Some(child) = *self.front.best {
            let deadline = self.deadline(sqrt(self.search.best_squared));
            *self.deadline_of(child).ok_or(QueryError::Corrupt { row: 0 })? = deadline;
        }
        let mut closest = self.search.finish(lower)?;
        // A triangle that is closer by less than the accuracy may have been skipped.
        closest.accuracy *= 2.0;
        Ok(closest)
    }

    #[inline(always)]
    fn deadline_of(&mut self, child: ChildSlot) -> Option<&mut Deadline> {
        self.front.node(child.node)?.deadlines.get_mut(usize::from(child.slot))
    }

    /// Tests the due bounds below an opened node, and opens the children within the cutoff.
    fn visit(&mut self, at: u16) -> Result<Visit, QueryError> {
        if let Expansion::OutOfBudget = self.test_due(at)? {
            return Ok(Visit::OutOfBudget);
        }
        while let Some(top) = self.search.waiting.checked_sub(1) {
            let corrupt = QueryError::Corrupt { row: top as u32 };
            let &WaitingNode { lower, link: word } = self.search.stack.get(top).ok_or(corrupt)?;
            let child = ChildSlot::from_word(word);
            if lower > self.search.cutoff {
                self.search.waiting = top;
                self.front.put_back(child).ok_or(corrupt)?;
                continue;
            }
            let deadline = *self.deadline_of(child).ok_or(corrupt)?;
            let link = self.record(child).ok_or(corrupt)?.link;
            let Some(opened) = self.front.open(link, child, deadline) else {
                return Ok(Visit::Full);
            };
            self.search.waiting = top;
            if let Expansion::OutOfBudget = self.test_due(opened)? {
                return Ok(Visit::OutOfBudget);
            }
        }
        Ok(Visit::Done)
    }

    #[inline(always)]
    fn record(&mut self, child: ChildSlot) -> Option<Node> {
        match NodeLink::decode(self.front.node(child.node)?.link) {
            NodeLink::Children { first, count } if u32::from(child.slot) < count => {
                self.search.tree.whole_record(first + u32::from(child.slot))
            }
            _ => None,
        }
    }

    fn put_back_waiting(&mut self) -> Option<()> {
        while let Some(top) = self.search.waiting.checked_sub(1) {
            self.search.waiting = top;
            self.front.put_back(ChildSlot::from_word(self.search.stack.get(top)?.link))?;
        }
        Some(())
    }

    /// Tests the due children of an opened node.
    fn test_due(&mut self, at: u16) -> Result<Expansion, QueryError> {
        let corrupt = QueryError::Corrupt { row: u32::from(at) };
        let threshold = self.threshold();
        let opened = self.front.node(at).ok_or(corrupt)?;
        if self.is_priced && self.search.meter.nodes(VISIT).is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        let (step, count) = match NodeLink::decode(opened.link) {
            // A free slot becomes due after `FAR` units of motion; it is rescheduled.
            _ if opened.link == UNUSED => (Expansion::Done, 0),
            NodeLink::Children { first, count } => {
                let due = opened.due(count, threshold);
                (self.test_children(at, first, due)?, count)
            }
            NodeLink::Leaf { first, count } => {
                let due = opened.due(count, threshold);
                let price = TRIANGLE * due.count_ones();
                if self.is_priced && self.search.meter.nodes(price).is_none() {
                    return Ok(Expansion::OutOfBudget);
                }
                (self.test_triangles(at, first, due)?, count)
            }
        };
        self.front.schedule(usize::from(at), count, &self.clock).ok_or(corrupt)?;
        Ok(step)
    }

    #[inline(always)]
    fn test_children(
        &mut self,
        at: u16,
        first: u32,
        mut due: u32,
    ) -> Result<Expansion, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let base = self.search.waiting;
        let (clock, margin, is_priced) = (self.clock, self.margin, self.is_priced);
        let later = |due: Deadline, bound: f32| due.or_later(clock.deadline(bound - margin));
        let search = &mut self.search;
        let tree = search.tree;
        let opened = self.front.node(at).ok_or(corrupt)?;
        while let Some(slot) = next(&mut due) {
            let node = tree.whole_record(first + u32::from(slot)).ok_or(corrupt)?;
            let due = opened.deadlines.get_mut(usize::from(slot)).ok_or(corrupt)?;
            if search.meter.node().is_none() {
                return Ok(Expansion::OutOfBudget);
            }
            let (position, normal, distance, own) = search.child(&node)?;
            search.lower_cutoff_to_pin(node.pin, distance);
            *due = later(*due, own);
            if own > search.cutoff {
                continue;
            }
            if let NodeLink::Leaf { first, count } = NodeLink::decode(node.link)
                && search.meter.nodes(if is_priced { 1 + CHILD_PLANE } else { 1 }).is_some()
            {
                let plane = search.plane_across(normal, position, distance);
                let excess = plane.excess(tree, search.vertices, first, count).ok_or(corrupt)?;
                if excess > 0.0 {
                    *due = later(*due, search.cutoff + excess / distance);
                    continue;
                }
            }
            opened.apart |= 1 << slot;
            let link = ChildSlot { node: at, slot }.to_word();
            search.push(base, WaitingNode { lower: own, link }).ok_or(corrupt)?;
        }
        Ok(Expansion::Done)
    }

    #[inline(always)]
    fn test_triangles(
        &mut self,
        at: u16,
        first: u32,
        mut due: u32,
    ) -> Result<Expansion, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        while let Some(slot) = next(&mut due) {
            let (triangle, child) = (first + u32::from(slot), ChildSlot { node: at, slot });
            if triangle == self.search.best_triangle {
                self.front.node(at).ok_or(corrupt)?.apart |= 1 << slot;
                *self.front.best = Some(child);
                continue;
            }
            let search = &mut self.search;
            if search.meter.triangle_plane().is_none() {
                return Ok(Expansion::OutOfBudget);
            }
            let corners = search.corners(triangle)?;
            let facing = self.facing.lowest(&corners);
            let bound = if facing > self.facing.within {
                // A large flat part lies along the plane, but few of its triangles are near.
                if facing * facing <= search.tie_squared && !(search.excess(&corners).0 > 0.0) {
                    search.add_tie(triangle, facing * facing);
                }
                facing
            } else {
                match self.test_closely(triangle, &corners, child)? {
                    Some(bound) => bound,
                    None => continue,
                }
            };
            let deadline = self.deadline(bound);
            *self.deadline_of(child).ok_or(corrupt)? = deadline;
        }
        Ok(Expansion::Done)
    }

    /// Tests a triangle against its own plane, then exactly. Returns a bound; none if it is the closest so far.
    fn test_closely(
        &mut self,
        triangle: u32,
        corners: &[Vec3; 3],
        child: ChildSlot,
    ) -> Result<Option<f32>, QueryError> {
        let before = self.search.best_squared;
        let (bound, is_closest) = self.search.bound_triangle(triangle, corners)?;
        if !is_closest {
            return Ok(Some(bound));
        }
        self.facing = FacingPlane::new(&self.search);
        let corrupt = QueryError::Corrupt { row: triangle };
        if let Some(child) = self.front.best.replace(child) {
            // It was the closest in this tick, too: its bound is not older than that.
            let deadline = self.deadline(sqrt(before));
            *self.deadline_of(child).ok_or(corrupt)? = deadline;
            self.front.put_back(child).ok_or(corrupt)?;
        }
        self.front.node(child.node).ok_or(corrupt)?.apart |= 1 << child.slot;
        Ok(None)
    }

    /// Tests some opened nodes, in turn from tick to tick, and closes those whose own sphere gives a sufficient bound.
    #[inline(always)]
    fn close_some(&mut self, number: u32) -> Result<(), QueryError> {
        let corrupt = QueryError::Corrupt { row: 0 };
        for _ in 0..number {
            let Some((at, due)) = self.front.next_closable() else { continue };
            let left = due.units_after(self.threshold());
            if left <= 0 {
                continue;
            }
            if self.search.meter.node().is_none() {
                return Ok(());
            }
            let opened = self.front.node(at).ok_or(corrupt)?;
            let child = ChildSlot { node: opened.parent, slot: opened.slot };
            let node = self.record(child).ok_or(corrupt)?;
            let distance =
                sqrt(self.search.tool.axis_distance_squared(self.search.position(node.pin)?));
            let own = self.deadline(distance - node.radius_code as f32 * self.search.radius_scale);
            if own.units_after(self.threshold()).saturating_mul(2) >= left {
                self.front.close(at, due.or_later(own), &self.clock).ok_or(corrupt)?;
            }
        }
        Ok(())
    }
}

/// The outcome of a visit to an opened node.
enum Visit {
    Done,
    OutOfBudget,
    Full,
}

/// Removes the lowest element of a set.
#[inline(always)]
fn next(set: &mut u32) -> Option<u8> {
    let rest = *set & set.checked_sub(1)?;
    let at = set.trailing_zeros() as u8;
    *set = rest;
    Some(at)
}

const _: () = assert!(FAR > LARGE_STEP as i32);

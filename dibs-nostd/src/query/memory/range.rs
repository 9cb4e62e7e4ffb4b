//! The front of a range search: the nodes that were opened.
//!
//! A child of an opened node is opened itself, or a leaf within the range, or farther: all farther children of a node
//! share one deadline. Leaves within the range are visited in every tick, farther children once the deadline has
//! passed. Opened nodes stay open until no slot is free; then the front restarts.

use super::clock::{Deadline, MotionClock, Reading};
use crate::tree::format::{MAX_CHILDREN, NodeLink};

/// After a motion of more units than this, a 16th to a 32nd of the root sphere's radius, the front restarts.
const JUMP: u32 = 1 << 20;

/// A node whose children are handled separately.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct RangeNode {
    /// Its children, as a link.
    pub link: u32,
    /// Deadline of the least bound of the farther children.
    pub deadline: Deadline,
    /// Opened children, one bit each.
    pub opened: u8,
    /// Leaves that neither their sphere nor their plane rejected, one bit each.
    pub near: u8,
}

/// The opened nodes, at most `M`.
#[derive(Clone, Debug)]
pub(in crate::query) struct RangeFront<const M: usize> {
    /// No vector: `Tracker::opened_in_range` is a constant function, and a vector's length is not constant.
    nodes: [RangeNode; M],
    state: RangeState,
}

#[derive(Clone, Debug)]
struct RangeState {
    count: usize,
    /// When every node was last visited, at most [`JUMP`] before the last search; none after an error.
    searched: Option<Reading>,
    /// The label of the leaves in `near`, if only one is searched.
    part: Option<u8>,
}

/// The front without its size, in a tick.
pub(in crate::query) struct RangeFrontMut<'f> {
    nodes: &'f mut [RangeNode],
    state: &'f mut RangeState,
    searched: Reading,
    pub clock: MotionClock,
}

impl<const M: usize> RangeFront<M> {
    /// All zeros, as [`Front::EMPTY`](super::front::Front::EMPTY).
    pub const EMPTY: Self = {
        let none = RangeNode { link: 0, deadline: Deadline::UNUSED, opened: 0, near: 0 };
        Self { nodes: [none; M], state: RangeState { count: 0, searched: None, part: None } }
    };

    /// Number of opened nodes.
    pub const fn opened(&self) -> u32 {
        self.state.count as u32
    }

    pub fn forget(&mut self) {
        self.state.searched = None;
    }

    /// The front at a reading, for a search of the whole surface or of one label's part.
    pub fn now(&mut self, clock: MotionClock, part: Option<u8>) -> RangeFrontMut<'_> {
        let Self { nodes, state } = self;
        let searched = state.searched.filter(|_| state.part == part);
        let kept = searched.filter(|&at| clock.since(at) <= JUMP && state.count < M);
        if kept.is_none() {
            state.count = 0;
        }
        (state.searched, state.part) = (None, part);
        RangeFrontMut { nodes, state, searched: kept.unwrap_or(clock.now()), clock }
    }
}

impl RangeFrontMut<'_> {
    /// Ends the search. Nodes that the budget did not reach are unchanged and stay due; as deadlines wrap, the front
    /// restarts if that lasts too long.
    pub fn keep(&mut self, is_whole: bool) {
        self.state.searched = Some(if is_whole { self.clock.now() } else { self.searched });
    }

    pub const fn is_empty(&self) -> bool {
        self.state.count == 0
    }

    /// Number of opened nodes.
    pub const fn opened(&self) -> u32 {
        self.state.count as u32
    }

    /// Opens a node; `None` if there is no free slot.
    pub fn open(&mut self, link: u32, deadline: Deadline) -> Option<()> {
        let opened = RangeNode { link, deadline, opened: 0, near: 0 };
        *self.nodes.get_mut(self.state.count)? = opened;
        self.state.count += 1;
        Some(())
    }

    /// Opens the roots, if nothing is open.
    pub fn start(&mut self, roots: u32) -> Option<()> {
        let now = self.clock.deadline(0.0);
        for first in (0..roots).step_by(MAX_CHILDREN as usize) {
            let rest = roots - first;
            let count = if rest < MAX_CHILDREN { rest } else { MAX_CHILDREN };
            self.open(NodeLink::Children { first, count }.encode(), now)?;
        }
        Some(())
    }

    #[inline(always)]
    pub fn node(&self, at: usize) -> Option<RangeNode> {
        if at < self.state.count { self.nodes.get(at).copied() } else { None }
    }

    #[inline(always)]
    pub fn node_mut(&mut self, at: usize) -> Option<&mut RangeNode> {
        self.nodes.get_mut(at)
    }

    /// The opened nodes from an index on.
    pub fn rest(&self, from: usize) -> &[RangeNode] {
        self.nodes.get(from..self.state.count).unwrap_or_default()
    }
}

//! The front: the opened top of the tree, and the deadline of each bound.

use core::ops::Range;

use super::clock::{Deadline, MotionClock};
use crate::tree::format::{MAX_CHILDREN, NodeLink};

/// A node whose children (or, for a leaf, whose triangles) have separate bounds.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct FrontNode {
    /// The node's children or triangles, as a link; [`UNUSED`] in a free slot.
    pub link: u32,
    /// Slot of the parent node; in a free slot, the next free one, counted from 1.
    pub parent: u16,
    /// Index among the parent's children.
    pub slot: u8,
    /// The children without a bound, one bit each: opened, on the search's stack, or the closest triangle.
    pub apart: u8,
    /// Deadline of each child's bound; unused for a child without one.
    pub deadlines: [Deadline; MAX_CHILDREN as usize],
}

/// A link that no node has: eight children in rows beyond any tree.
pub(in crate::query) const UNUSED: u32 = u32::MAX >> 1;
/// No slot: one more than the largest.
pub(in crate::query) const NOWHERE: u16 = u16::MAX;
/// No free slot. Free slots are counted from 1, so that this is zero.
const NO_FREE: u16 = 0;

impl FrontNode {
    const FREE: Self = Self {
        link: UNUSED,
        parent: NO_FREE,
        slot: 0,
        apart: 0,
        deadlines: [Deadline::UNUSED; MAX_CHILDREN as usize],
    };

    const NEVER_USED: Self = Self {
        link: 0,
        parent: 0,
        slot: 0,
        apart: 0,
        deadlines: [Deadline::UNUSED; MAX_CHILDREN as usize],
    };

    /// The children whose bounds have run out, one bit each.
    #[inline(always)]
    pub fn due(&self, count: u32, threshold: Deadline) -> u32 {
        let mut due = 0;
        for &deadline in self.deadlines.iter().rev() {
            due = due << 1 | u32::from(!threshold.is_before(deadline));
        }
        due & !u32::from(self.apart) & !(u32::MAX << count)
    }
}

/// A child of an opened node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::query) struct ChildSlot {
    pub node: u16,
    pub slot: u8,
}

impl ChildSlot {
    /// The node and slot as a word on the search's stack.
    #[inline(always)]
    pub fn to_word(self) -> u32 {
        u32::from(self.node) << 3 | u32::from(self.slot)
    }

    #[inline(always)]
    pub fn from_word(word: u32) -> Self {
        Self { node: (word >> 3) as u16, slot: (word & 7) as u8 }
    }
}

/// The opened nodes, one in each slot. A tick reads one deadline for each opened node, not for each child.
#[derive(Clone, Debug)]
pub(in crate::query) struct Front<const OPENED: usize> {
    /// The earliest of each node's deadlines. (A separate table, since each tick reads all of it.)
    due: [Deadline; OPENED],
    nodes: [FrontNode; OPENED],
    /// Slots from here on are unused since the last clear.
    end: usize,
    /// The first free slot, counted from 1; [`NO_FREE`] if there is none.
    free: u16,
    /// The slot at which the last tick's budget ended; zero after a complete one.
    resume: u16,
    /// The closest triangle, as a child.
    pub best: Option<ChildSlot>,
    /// The slot last examined for closing.
    clock_hand: u16,
}

impl<const OPENED: usize> Front<OPENED> {
    /// All zeros, so that memory is cleared in place, without a copy on the stack.
    pub const EMPTY: Self = {
        assert!(OPENED > 0 && OPENED < NOWHERE as usize);
        Self {
            due: [Deadline::UNUSED; OPENED],
            nodes: [FrontNode::NEVER_USED; OPENED],
            end: 0,
            free: NO_FREE,
            resume: 0,
            best: None,
            clock_hand: 0,
        }
    };
}

/// The front without its size, so that a search is compiled once for all sizes.
#[derive(Debug)]
pub(in crate::query) struct FrontMut<'f> {
    due: &'f mut [Deadline],
    nodes: &'f mut [FrontNode],
    end: &'f mut usize,
    free: &'f mut u16,
    pub resume: &'f mut u16,
    pub best: &'f mut Option<ChildSlot>,
    clock_hand: &'f mut u16,
}

impl<const OPENED: usize> Front<OPENED> {
    #[inline(always)]
    pub fn borrow(&mut self) -> FrontMut<'_> {
        let Self { due, nodes, end, free, resume, best, clock_hand } = self;
        FrontMut { due, nodes, end, free, resume, best, clock_hand }
    }
}

impl<const OPENED: usize> Front<OPENED> {
    /// Rows of the nodes that have a bound, or whose triangles have bounds.
    pub fn rows(&self) -> impl Iterator<Item = u32> {
        let opened = self.nodes.iter().take(self.end).filter(|opened| opened.link != UNUSED);
        opened.flat_map(|opened| {
            let above = self.nodes.get(usize::from(opened.parent)).map(|above| above.link);
            let (first, bounded) =
                match (NodeLink::decode(opened.link), above.map(NodeLink::decode)) {
                    (NodeLink::Children { first, count }, _) => {
                        (first, !u32::from(opened.apart) & !(u32::MAX << count))
                    }
                    (NodeLink::Leaf { .. }, Some(NodeLink::Children { first, .. })) => {
                        (first, 1 << opened.slot)
                    }
                    // The root is a leaf.
                    (NodeLink::Leaf { .. }, _) => (0, 1),
                };
            (0..MAX_CHILDREN)
                .filter(move |slot| bounded >> slot & 1 == 1)
                .map(move |slot| first + slot)
        })
    }
}

#[cfg(feature = "control")]
impl<const OPENED: usize> Front<OPENED> {
    /// Number of slots that [`count_due`](Self::count_due) reads.
    pub fn opened(&self) -> usize {
        self.end
    }

    /// Number of nodes due.
    pub fn count_due(&self, threshold: Deadline) -> usize {
        due(self.due.get(..self.end).unwrap_or_default(), threshold)
    }
}

/// Number of deadlines that are not later than a threshold.
fn due(deadlines: &[Deadline], threshold: Deadline) -> usize {
    deadlines.iter().filter(|&&due| !threshold.is_before(due)).count()
}

impl FrontMut<'_> {
    /// Frees all slots.
    pub fn clear(&mut self) {
        (*self.end, *self.free, *self.best, *self.clock_hand) = (0, NO_FREE, None, 0);
        *self.resume = 0;
    }

    pub fn is_empty(&self) -> bool {
        *self.end == 0
    }

    /// Number of slots used since the last [`clear`](Self::clear).
    pub fn used(&self) -> usize {
        *self.end
    }

    #[inline(always)]
    pub fn node(&mut self, at: u16) -> Option<&mut FrontNode> {
        self.nodes.get_mut(usize::from(at))
    }

    /// The first slot in a range whose node is due.
    #[inline(always)]
    pub fn next_due(&self, slots: Range<usize>, threshold: Deadline) -> Option<usize> {
        let from = slots.start;
        let due = self.due.get(slots)?;
        // Eight at a time: usually none of them is due.
        let (eights, _) = due.as_chunks::<8>();
        let waits = |eight: &&[Deadline; 8]| {
            let before = eight.map(|due| threshold.units_after(due));
            before.iter().fold(-1, |all, before| all & before) < 0
        };
        let passed = 8 * eights.iter().take_while(waits).count();
        let at = due.get(passed..)?.iter().position(|&due| !threshold.is_before(due))?;
        Some(from + passed + at)
    }

    /// Number of nodes due.
    pub fn count_due(&self, threshold: Deadline) -> usize {
        due(self.due.get(..*self.end).unwrap_or_default(), threshold)
    }

    /// The earliest deadline.
    pub fn first(&self, clock: &MotionClock) -> Deadline {
        let due = self.due.get(..*self.end).unwrap_or_default();
        due.iter().fold(clock.never(), |first, &due| if due.is_before(first) { due } else { first })
    }

    /// Opens a node in a free slot, with one bound for everything below; `None` if there is no free slot.
    #[inline(always)]
    pub fn open(&mut self, link: u32, parent: ChildSlot, deadline: Deadline) -> Option<u16> {
        let at = self.free.checked_sub(1).map_or(*self.end, usize::from);
        let node = self.nodes.get_mut(at)?;
        if at == *self.end {
            *self.end = at + 1;
        } else {
            *self.free = node.parent;
        }
        *self.due.get_mut(at)? = deadline;
        let deadlines = [deadline; MAX_CHILDREN as usize];
        *node = FrontNode { link, parent: parent.node, slot: parent.slot, apart: 0, deadlines };
        Some(at as u16)
    }

    /// Frees a slot, and gives the node's parent a bound for it.
    pub fn close(&mut self, at: u16, deadline: Deadline, clock: &MotionClock) -> Option<()> {
        let free = *self.free;
        let node = self.node(at)?;
        let child = ChildSlot { node: node.parent, slot: node.slot };
        *node = FrontNode { parent: free, ..FrontNode::FREE };
        *self.free = at.wrapping_add(1);
        *self.due.get_mut(usize::from(at))? = clock.never();
        *self.node(child.node)?.deadlines.get_mut(usize::from(child.slot))? = deadline;
        self.put_back(child)
    }

    /// Gives a child a bound of its node again.
    #[inline(always)]
    pub fn put_back(&mut self, ChildSlot { node, slot }: ChildSlot) -> Option<()> {
        let due = self.due.get_mut(usize::from(node))?;
        let node = self.nodes.get_mut(usize::from(node))?;
        node.apart &= !(1 << slot);
        let &deadline = node.deadlines.get(usize::from(slot))?;
        if deadline.is_before(*due) {
            *due = deadline;
        }
        Some(())
    }

    /// Updates the earliest of a node's deadlines.
    #[inline(always)]
    pub fn schedule(&mut self, at: usize, count: u32, clock: &MotionClock) -> Option<()> {
        let node = self.nodes.get(at)?;
        let mut apart = node.apart;
        let mut first = clock.never();
        for &deadline in node.deadlines.get(..count as usize)? {
            if apart & 1 == 0 && deadline.is_before(first) {
                first = deadline;
            }
            apart >>= 1;
        }
        *self.due.get_mut(at)? = first;
        Some(())
    }

    /// Advances the clock hand by one slot. Returns the node there and its earliest deadline, if it may be closed:
    /// opened, below a root, all children with bounds.
    pub fn next_closable(&mut self) -> Option<(u16, Deadline)> {
        let next = self.clock_hand.saturating_add(1);
        *self.clock_hand = if usize::from(next) < *self.end { next } else { 0 };
        let at = usize::from(*self.clock_hand);
        let (node, &due) = (self.nodes.get(at)?, self.due.get(at)?);
        (node.apart == 0 && node.link != UNUSED && node.parent != NOWHERE)
            .then_some((*self.clock_hand, due))
    }
}

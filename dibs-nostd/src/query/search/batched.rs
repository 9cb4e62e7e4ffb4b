//! The batched search: batches of up to seven subtrees.
//!
//! A search of one subtree at a time is a chain of dependences: its distances decide which subtree is next, and each
//! child costs an unpredictable branch. This takes half of a query's time on a large processor. A batch overlaps the
//! loads and square roots of all its children, compares four children by one instruction, and sorts the rest without
//! branches.
//!
//! Batching wastes few tests: most queued subtrees would be visited anyway. It often saves some, because the
//! pins of seven subtrees lower the cutoff before a child is compared with it.

// Requirement: A-01

mod leaf;
mod order;

use glam::Vec4;

use super::{Expansion, Search, WaitingNode};
use crate::math::sqrt::sqrt;
use crate::math::vec3x4::{Vec3x4, roots};
use crate::tree::format::several::four_nodes;
use crate::tree::format::{MAX_CHILDREN, NodeLink, node_bytes};
use crate::unavailable::QueryError;
use crate::{Index, Proximity, Tool, VertexTable};

/// Most subtrees in a batch. A larger batch hides more latency but prunes with an older bound. The set of its children
/// must fit in 64 bits.
const SUBTREES: usize = 7;
const MOST: usize = SUBTREES * MAX_CHILDREN as usize;
const BLOCKS: usize = MOST / 4;
const MOST_NODE_BYTES: usize = node_bytes::<u32>();
/// Most entries that a batch of several subtrees leaves on the stack, so that test counts do not depend on the size of
/// a large stack.
const MOST_WAITING: usize = 128;

pub(in crate::query) struct BatchedSearch<'s, 't, I, V: ?Sized, T> {
    search: Search<'s, 't, I, V, T>,
    /// Most entries that a batch of several subtrees may leave: the rest of the stack suffices for one subtree at a
    /// time.
    room: usize,
    /// Records of the batch's children. Other nodes fill the last block of four: their pins may lower the cutoff, but
    /// they are not compared with it.
    records: [u8; (MOST + MAX_CHILDREN as usize) * MOST_NODE_BYTES],
    /// Lower bounds inherited from the children's parents.
    parents: [f32; MOST + MAX_CHILDREN as usize],
    /// Squared distances of the children's pins.
    squares: [Vec4; BLOCKS],
    lowers: [[f32; 4]; BLOCKS],
    /// Sorting keys of the children below the cutoff.
    keys: [[i32; 4]; BLOCKS + 2],
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> BatchedSearch<'s, 't, I, V, T> {
    pub fn new(search: Search<'s, 't, I, V, T>) -> Self {
        let spare = search.stack.len().saturating_sub(search.tree.stack() as usize);
        Self {
            search,
            room: if spare < MOST_WAITING { spare } else { MOST_WAITING },
            records: [0; _],
            parents: [0.0; _],
            squares: [Vec4::ZERO; _],
            lowers: [[0.0; 4]; _],
            keys: [[0; 4]; _],
        }
    }

    /// Visits subtrees, nearest first, until none is below the cutoff or the budget runs out.
    pub fn run(mut self) -> Result<Proximity, QueryError> {
        while let Some(top) = self.search.waiting.checked_sub(1) {
            let corrupt = QueryError::Corrupt { row: top as u32 };
            let &WaitingNode { lower, link } = self.search.stack.get(top).ok_or(corrupt)?;
            let step = match NodeLink::decode(link) {
                NodeLink::Children { .. } => self.expand_batch(),
                NodeLink::Leaf { .. } if lower > self.search.cutoff => {
                    self.search.waiting = top;
                    continue;
                }
                NodeLink::Leaf { first, count } => {
                    self.search.waiting = top;
                    self.search.leaf_at_once(first, count)
                }
            };
            if matches!(step?, Expansion::OutOfBudget) {
                self.search.leave_unfinished();
                return self.search.finish(self.search.least_waiting(lower));
            }
        }
        self.search.finish(f32::INFINITY)
    }

    /// Tests the children of the subtrees on top of the stack.
    #[inline(never)]
    fn expand_batch(&mut self) -> Result<Expansion, QueryError> {
        let corrupt = QueryError::Corrupt { row: self.search.waiting as u32 };
        let (subtrees, children) = self.take().ok_or(corrupt)?;
        // A batch is never split, so that a query with more budget takes the same steps, then more.
        if self.search.meter.nodes(children as u32).is_none() {
            return Ok(Expansion::OutOfBudget);
        }
        self.search.waiting -= subtrees;
        self.measure(children).ok_or(corrupt)?;
        let (near, leaves) = self.judge(children).ok_or(corrupt)?;
        let near = self.reject_leaves(near, leaves).ok_or(corrupt)?;
        self.push(near).ok_or(corrupt)?;
        Ok(Expansion::Done)
    }

    /// Copies the children of the nearest subtrees, as many as the stack has room for. Returns the numbers of subtrees
    /// and children; a subtree above the current cutoff adds no children.
    #[inline(always)]
    fn take(&mut self) -> Option<(usize, usize)> {
        let Self { search, room, records, parents, .. } = self;
        let (mut subtrees, mut children) = (0, 0);
        let from = search.waiting.saturating_sub(SUBTREES);
        for &WaitingNode { lower, link } in search.stack.get(from..search.waiting)?.iter().rev() {
            let NodeLink::Children { first, count } = NodeLink::decode(link) else { break };
            let all = children + count as usize;
            if subtrees > 0 && search.waiting + all > *room + subtrees + 1 {
                break;
            }
            let slots = records.get_mut(children * node_bytes::<I>()..)?;
            search.tree.copy_nodes(first, count, slots)?;
            *parents.get_mut(children..)?.first_chunk_mut()? = [lower; MAX_CHILDREN as usize];
            children = if lower > search.cutoff { children } else { all };
            subtrees += 1;
        }
        Some((subtrees, children))
    }

    /// Measures the distances of the children's pins. The nearest lowers the cutoff.
    #[inline(always)]
    fn measure(&mut self, children: usize) -> Option<()> {
        let Self { search, records, squares, .. } = self;
        let (vertices, tool) = (search.vertices, *search.tool);
        let squares = squares.get_mut(..children.div_ceil(4))?;
        let blocks = || records.chunks_exact(4 * node_bytes::<I>());
        let mut least = Vec4::INFINITY;
        for (nodes, squared) in blocks().zip(squares.iter_mut()) {
            let pins = four_nodes::<I>(nodes)?.map(|node| node.pin);
            let to = tool.axis_to_four(&Vec3x4::of(|row| vertices.position(row), pins)?);
            *squared = to.dot(to);
            least = Vec4::select(squared.cmplt(least), *squared, least);
        }
        let least = least.min_element();
        let distance = sqrt(least);
        if distance < search.nearest_pin.distance {
            for (nodes, squared) in blocks().zip(squares.iter()) {
                let mut equal = u64::from(squared.cmpeq(Vec4::splat(least)).bitmask());
                if let Some(lane) = next(&mut equal) {
                    search.lower_cutoff_to_pin(four_nodes::<I>(nodes)?.get(lane)?.pin, distance);
                    break;
                }
            }
        }
        Some(())
    }

    /// Compares the children's spheres with the cutoff. Returns the set of the children below it, and of the leaves
    /// among them.
    #[inline(always)]
    fn judge(&mut self, children: usize) -> Option<(u64, u64)> {
        let Self { search, records, parents, squares, lowers, .. } = self;
        let (blocks, bytes) = (children.div_ceil(4), 4 * node_bytes::<I>());
        let (cutoff, scale) = (Vec4::splat(search.cutoff), search.radius_scale);
        let (mut near, mut leaves) = (0, 0);
        let nodes = records.get(..blocks * bytes)?.chunks_exact(bytes);
        let parents = parents.as_chunks::<4>().0.get(..blocks)?;
        let bounds = squares.get(..blocks)?.iter().zip(lowers.get_mut(..blocks)?);
        for ((nodes, parents), (squared, lowers)) in nodes.zip(parents).zip(bounds).rev() {
            let nodes = four_nodes::<I>(nodes)?;
            let codes = nodes.map(|node| node.radius_code as i32 as f32);
            let radius = Vec4::from_array(codes) * scale;
            let far = cutoff + radius;
            // NaN counts as near: the leaves below report the vertex that it comes from.
            let within = !squared.cmpgt(far * far).bitmask() & 0xF;
            near = near << 4 | u64::from(within);
            let links = Vec4::from_array(nodes.map(|node| f32::from_bits(node.link)));
            leaves = leaves << 4 | u64::from(links.is_negative_bitmask());
            let (own, parents) = (roots(*squared) - radius, Vec4::from_array(*parents));
            *lowers = Vec4::select(own.cmpgt(parents), own, parents).to_array();
        }
        let near = near & !u64::MAX.checked_shl(children as u32).unwrap_or(0);
        Some((near, near & leaves))
    }
}

/// Removes the lowest element of a set.
#[inline(always)]
fn next(set: &mut u64) -> Option<usize> {
    let rest = *set & set.checked_sub(1)?;
    let at = set.trailing_zeros() as usize;
    *set = rest;
    Some(at)
}

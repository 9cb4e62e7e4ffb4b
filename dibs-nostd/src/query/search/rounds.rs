//! The same search in rounds: up to six subtrees at once.
//!
//! One subtree after the other is a chain: each takes its distances to say which is next, and a branch
//! for each child that no processor can foretell. Half of a query's time on a large processor goes there.
//! A round takes its subtrees together, so that the loads and roots of all their children overlap, and
//! judges four children by one comparison.
//!
//! Little of it is in vain: of what waits, 98 % is still within reach when its turn comes. And there is a
//! gain in tests: the pins of six subtrees have pulled the reach in before a triangle is looked at.

use core::array;
use core::hint::black_box;

use glam::Vec4;

use super::{Search, Step, Waiting};
use crate::format::{Link, MAX_CHILDREN};
use crate::query::QueryError;
use crate::sqrt::sqrt;
use crate::{Index, Proximity, Tool, VertexTable};

/// Most subtrees in a round. More overlap, but see a looser reach.
const SUBTREES: usize = 6;
const MOST: usize = SUBTREES * MAX_CHILDREN as usize;
/// Most entries that a round of several subtrees leaves waiting, so that counts do not depend on the
/// stack as long as it is large.
const MOST_WAITING: usize = 64;

/// A search in rounds.
pub(in crate::query) struct Rounds<'s, 't, I, V: ?Sized, T> {
    search: Search<'s, 't, I, V, T>,
    /// How many may wait after a round of several subtrees: what is left of the stack is enough for one
    /// subtree after the other.
    room: usize,
    /// Rows of the round's children, and lower bounds of their parents. After the last child the root
    /// fills its block up: known already, it changes nothing.
    rows: [u32; MOST + 4],
    parents: [f32; MOST + 4],
    blocks: [Block; MOST / 4],
}

/// Four children.
#[derive(Clone, Copy, Default)]
struct Block {
    pins: [u32; 4],
    links: [u32; 4],
    distances: [f32; 4],
    lowers: [f32; 4],
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Rounds<'s, 't, I, V, T> {
    pub fn new(search: Search<'s, 't, I, V, T>) -> Self {
        let spare = search.stack.len().saturating_sub(search.tree.stack() as usize);
        Self {
            search,
            room: if spare < MOST_WAITING { spare } else { MOST_WAITING },
            rows: [0; _],
            parents: [0.0; _],
            blocks: [Block::default(); _],
        }
    }

    /// Looks at subtrees, near ones first, until none within reach is left or the budget runs out.
    pub fn run(mut self) -> Result<Proximity, QueryError> {
        while let Some(top) = self.search.waiting.checked_sub(1) {
            let corrupt = QueryError::Corrupt { row: top as u32 };
            let &Waiting { lower, link } = self.search.stack.get(top).ok_or(corrupt)?;
            let step = match Link::decode(link) {
                Link::Children { .. } => self.round(),
                Link::Leaf { .. } if lower > self.search.reach => {
                    self.search.waiting = top;
                    continue;
                }
                Link::Leaf { first, count } => {
                    self.search.waiting = top;
                    self.search.leaf(first, count)
                }
            };
            if matches!(step?, Step::OutOfBudget) {
                return self.search.finish(self.search.least_waiting(lower));
            }
        }
        self.search.finish(f32::INFINITY)
    }

    /// Tests the children of the subtrees on top of the stack.
    #[inline(never)]
    fn round(&mut self) -> Result<Step, QueryError> {
        let corrupt = QueryError::Corrupt { row: self.search.waiting as u32 };
        let (subtrees, children) = self.take().ok_or(corrupt)?;
        // All of the round or nothing: with more budget a query goes the same way further.
        let Some(left) = self.search.left.node_tests.checked_sub(children as u32) else {
            return Ok(Step::OutOfBudget);
        };
        self.search.left.node_tests = left;
        self.search.waiting -= subtrees;
        let (near, leaves) = self.judge(children).ok_or(corrupt)?;
        let near = self.reject_leaves(near, leaves).ok_or(corrupt)?;
        self.push(near).ok_or(corrupt)?;
        Ok(Step::Done)
    }

    /// Lists the children of the nearest subtrees, as many as the stack is enough for. Returns the number of
    /// subtrees and that of children: those of a subtree that is out of reach by now do not count.
    fn take(&mut self) -> Option<(usize, usize)> {
        let Self { search, room, rows, parents, .. } = self;
        let (mut subtrees, mut children) = (0, 0);
        let from = search.waiting.saturating_sub(SUBTREES);
        for &Waiting { lower, link } in search.stack.get(from..search.waiting)?.iter().rev() {
            let Link::Children { first, count } = Link::decode(link) else { break };
            let all = children + count as usize;
            if subtrees > 0 && search.waiting + all > *room + subtrees + 1 {
                break;
            }
            // As many as there may be, so that no loop ends sooner or later: the next are written over.
            *rows.get_mut(children..)?.first_chunk_mut::<8>()? =
                array::from_fn(|i| first + i as u32);
            *parents.get_mut(children..)?.first_chunk_mut::<8>()? = [lower; 8];
            children = if lower > search.reach { children } else { all };
            subtrees += 1;
        }
        *rows.get_mut(children..)?.first_chunk_mut::<4>()? = [0; 4];
        Some((subtrees, children))
    }

    /// Tests the spheres of the children, in their order: each pin that is nearer than all before pulls in
    /// the reach for the next. Returns the set of those within reach.
    #[inline(always)]
    fn judge(&mut self, children: usize) -> Option<(u64, u64)> {
        let Self { search, rows, parents, blocks, .. } = self;
        let (tree, vertices) = (search.tree, search.vertices);
        let (rows, _) = rows.as_chunks::<4>();
        let (parents, _) = parents.as_chunks::<4>();
        let (mut near, mut leaves) = (0, 0);
        let places = rows.iter().zip(parents).zip(blocks);
        for (start, ((rows, parents), block)) in (0..children).step_by(4).zip(places) {
            let [a, b, c, d] = *rows;
            let node = |row| tree.whole_record(row);
            let (a, b, c, d) = (node(a)?, node(b)?, node(c)?, node(d)?);
            let squared = |pin| Some(search.tool.axis_distance_squared(vertices.position(pin)?));
            let squared =
                Vec4::new(squared(a.pin)?, squared(b.pin)?, squared(c.pin)?, squared(d.pin)?);
            let codes = [a.radius_code, b.radius_code, c.radius_code, d.radius_code];
            let radius = Vec4::from_array(codes.map(|code| code as f32)) * search.radius_scale;
            let far = Vec4::splat(search.reach) + radius;
            let distance = Vec4::from_array(squared.to_array().map(sqrt));
            block.pins = [a.pin, b.pin, c.pin, d.pin];
            block.links = [a.link, b.link, c.link, d.link];
            block.distances = distance.to_array();
            // What is not a number is not far: the leaves below find out what it is.
            let mut within = !squared.cmpgt(far * far).bitmask() & 0xF;
            if within & distance.cmplt(Vec4::splat(search.pin.1)).bitmask() != 0 {
                within = search.one_by_one(block, squared, radius, children - start);
            }
            near |= u64::from(within) << start;
            let marks =
                (a.link >> 31) | (b.link >> 31 << 1) | (c.link >> 31 << 2) | (d.link >> 31 << 3);
            leaves |= u64::from(marks) << start;
            let (own, parents) = (distance - radius, Vec4::from_array(*parents));
            block.lowers = Vec4::select(own.cmpgt(parents), own, parents).to_array();
        }
        let near = near & !(u64::MAX << children);
        Some((near, near & leaves))
    }

    /// Tests the planes of those that are leaves. Returns the set of what is left.
    #[inline(always)]
    fn reject_leaves(&mut self, near: u64, mut leaves: u64) -> Option<u64> {
        let mut left = near;
        while let Some(at) = next(&mut leaves) {
            let (block, lane) = (self.blocks.get(at / 4)?, at % 4);
            if let Link::Leaf { first, count } = Link::decode(block.links[lane])
                && let Some(tests) = self.search.left.node_tests.checked_sub(1)
            {
                self.search.left.node_tests = tests;
                let (tree, vertices) = (self.search.tree, self.search.vertices);
                let position = vertices.position(block.pins[lane])?;
                let normal = self.search.tool.axis_to(position);
                let plane = self.search.plane_across(normal, position, block.distances[lane]);
                if plane.beyond(tree, vertices, first, count)? == count {
                    left &= !(1 << at);
                }
            }
        }
        Some(left)
    }

    /// Lets the children in a set wait, the nearest of all on top.
    #[inline(always)]
    fn push(&mut self, mut set: u64) -> Option<()> {
        let base = self.search.waiting;
        while let Some(at) = next(&mut set) {
            let (block, lane) = (self.blocks.get(at / 4)?, at % 4);
            let link = block.links[lane];
            if let Link::Children { first, .. } = Link::decode(link) {
                // Only to have it fetched: on a large mesh the memory takes longer than all the rest.
                black_box(self.search.tree.whole_record(first)?.pin);
            }
            self.search.push(base, Waiting { lower: block.lowers[lane], link })?;
        }
        Some(())
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Tests the first `count` spheres of a block, of which one pulls in the reach. Returns the set of those
    /// within it.
    #[inline(never)]
    fn one_by_one(&mut self, block: &Block, squared: Vec4, radius: Vec4, count: usize) -> u32 {
        let spheres = squared.to_array().into_iter().zip(radius.to_array());
        let pins = block.pins.into_iter().zip(block.distances);
        let mut within = 0;
        for (lane, ((squared, radius), (pin, distance))) in
            spheres.zip(pins).take(count).enumerate()
        {
            let far = self.reach + radius;
            if !(squared > far * far) {
                within |= 1 << lane;
                self.pull_in(pin, distance);
            }
        }
        within
    }
}

/// Takes the first element out of a set.
#[inline(always)]
fn next(set: &mut u64) -> Option<usize> {
    let rest = *set & set.checked_sub(1)?;
    let at = set.trailing_zeros() as usize;
    *set = rest;
    Some(at)
}

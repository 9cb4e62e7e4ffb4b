//! A tree of axis-aligned boxes: built once with the surface area heuristic, then refitted.

use std::ops::Range;

use dibs_build::Mesh;
use glam::{Vec3, Vec3A};

use super::bounds::Axis;
use super::boxes::{self, BoxTree, Node, Rows, Start, each_once};
use crate::method::Found;

/// Largest number of triangles in a leaf.
const LEAF: usize = 6;
/// Bins of the surface area heuristic, and the cost of a box test relative to a triangle test.
const BINS: usize = 16;
const BOX_COST: f32 = 1.0;
/// Entries of the traversal's stack; `new` checks the tree's depth against them.
pub(super) const STACK: usize = 96;

/// A box: its lowest and highest corner.
pub type Bounds = [Vec3A; 2];

pub(super) const NOTHING: Bounds = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];

/// A node. Children are adjacent and after their parent, and all descendants of a node are one range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// The first child, or the first triangle.
    pub first: u32,
    /// 0 for an inner node; a leaf's number of triangles; [`DEFERRED`] and more for the hybrid's cut nodes.
    pub count: u32,
}

/// Counts from this value on mark an inner node whose descendants' boxes are outdated.
pub const DEFERRED: u32 = 1 << 31;

/// The tree. Its triangles are in the order of the leaves, its vertices in the order of the triangles.
#[derive(Clone)]
pub struct AabbTree {
    pub(super) boxes: Vec<Bounds>,
    pub(super) links: Vec<Link>,
    pub(super) rows: Rows,
    /// The indices of leaves and of inner nodes, ascending, so that a loop over either has no unpredictable branch.
    leaves: Vec<u32>,
    inner: Vec<u32>,
    /// The vertices of each leaf without duplicates, and the start of each leaf's part.
    leaf_vertices: Vec<u32>,
    leaf_start: Vec<u32>,
}

impl AabbTree {
    /// Builds the tree for the mesh at rest.
    ///
    /// # Panics
    /// If the tree is deeper than the traversal's stack.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| Vec3A::from(mesh.positions[v as usize]));
        let boxes: Vec<Bounds> =
            mesh.triangles.iter().map(|t| corners(t).into_iter().fold(NOTHING, grown)).collect();
        let Built { items, links, depth } = build(boxes, LEAF);
        assert!(depth < STACK, "the tree is {depth} deep");

        let rows = Rows::new(mesh, &items);
        let is_leaf = |&node: &u32| links[node as usize].count > 0;
        let (leaves, inner): (Vec<u32>, Vec<u32>) = (0..links.len() as u32).partition(is_leaf);
        let (mut leaf_vertices, mut leaf_start) = (Vec::new(), vec![0]);
        for &leaf in &leaves {
            let Link { first, count } = links[leaf as usize];
            leaf_vertices.extend(rows.vertices(first as usize..(first + count) as usize));
            leaf_start.push(leaf_vertices.len() as u32);
        }
        let mut tree = Self {
            boxes: vec![NOTHING; links.len()],
            links,
            rows,
            leaves,
            inner,
            leaf_vertices,
            leaf_start,
        };
        tree.rows.load(&mesh.positions);
        tree
    }

    /// Refits a range of nodes that includes all their descendants.
    pub(super) fn refit(&mut self, nodes: Range<usize>) {
        self.refit_to(nodes, |positions, bounds, row| grown(bounds, positions[row]));
    }

    /// Refits all nodes to two frames, the loaded one and `before`. A box contains every position between the two.
    pub(super) fn refit_over(&mut self, before: &[Vec3A]) {
        self.refit_to(0..self.links.len(), |positions, bounds, row| {
            grown(grown(bounds, positions[row]), before[row])
        });
    }

    /// Refits the leaves first, then the inner nodes from the last to the first, so that children come before parents.
    #[inline(always)]
    fn refit_to(&mut self, nodes: Range<usize>, grow: impl Fn(&[Vec3A], Bounds, usize) -> Bounds) {
        let leaves = within(&self.leaves, &nodes);
        let mut start = self.leaf_start[leaves.start] as usize;
        let ends = &self.leaf_start[leaves.start + 1..=leaves.end];
        for (&leaf, &end) in self.leaves[leaves].iter().zip(ends) {
            let of_leaf = &self.leaf_vertices[start..end as usize];
            let positions = self.rows.positions();
            let bounds = of_leaf.iter().fold(NOTHING, |b, &v| grow(positions, b, v as usize));
            self.boxes[leaf as usize] = bounds;
            start = end as usize;
        }
        for &node in self.inner[within(&self.inner, &nodes)].iter().rev() {
            let first = self.links[node as usize].first as usize;
            self.boxes[node as usize] = joined(self.boxes[first], self.boxes[first + 1]);
        }
    }

    /// The vertices below a range of nodes, without duplicates, in ascending order.
    pub(super) fn vertices_of(&self, nodes: &Range<usize>) -> Vec<u32> {
        let Range { start, end } = within(&self.leaves, nodes);
        let vertices = self.leaf_start[start] as usize..self.leaf_start[end] as usize;
        each_once(self.leaf_vertices[vertices].to_vec())
    }

    /// The range of a node's descendants.
    pub(super) fn descendants(&self, node: usize) -> Range<usize> {
        match self.links[node] {
            Link { first, count: 0 } => {
                let first = first as usize;
                let ends = [first, first + 1].map(|child| self.descendants(child).end);
                first..ends[0].max(ends[1]).max(first + 2)
            }
            _ => node..node,
        }
    }

    /// The closest pair. `refresh` refits the descendants of a deferred node and returns its first child.
    #[inline(always)]
    pub(super) fn closest<A: Axis>(
        &mut self,
        tool: &A,
        start: &mut Start,
        refresh: impl FnMut(&mut Self, usize) -> u32,
    ) -> Found {
        boxes::closest::<_, _, STACK>(&mut Refreshed { tree: self, refresh }, tool, start)
    }
}

/// A tree whose nodes are refitted during a search.
struct Refreshed<'t, F> {
    tree: &'t mut AabbTree,
    refresh: F,
}

impl<F: FnMut(&mut AabbTree, usize) -> u32> BoxTree for Refreshed<'_, F> {
    #[inline(always)]
    fn node(&mut self, node: u32) -> Node {
        match self.tree.links[node as usize] {
            Link { first, count: 0 } => Node::Inner(first),
            Link { count: DEFERRED.., .. } => Node::Inner((self.refresh)(self.tree, node as usize)),
            Link { first, count } => Node::Leaf(first as usize..(first + count) as usize),
        }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> Bounds {
        self.tree.boxes[node as usize]
    }

    #[inline(always)]
    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.tree.rows.corners(triangle)
    }
}

/// The range of an ascending list whose values are in `range`.
fn within(numbers: &[u32], range: &Range<usize>) -> Range<usize> {
    let below = |limit: usize| numbers.partition_point(|&number| (number as usize) < limit);
    below(range.start)..below(range.end)
}

#[inline(always)]
pub fn grown([low, high]: Bounds, point: Vec3A) -> Bounds {
    [low.min(point), high.max(point)]
}

#[inline(always)]
pub fn joined(a: Bounds, b: Bounds) -> Bounds {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Half the surface of a box.
fn area([low, high]: Bounds) -> f32 {
    let size = high - low;
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// A tree over some boxes: its nodes, and the boxes in the order of its leaves.
pub(super) struct Built {
    pub links: Vec<Link>,
    pub items: Vec<u32>,
    pub depth: usize,
}

/// Builds a tree over some boxes, with at most `most` in a leaf.
pub(super) fn build(boxes: Vec<Bounds>, most: usize) -> Built {
    let count = boxes.len();
    let mut builder = Builder {
        centres: boxes.iter().map(|[low, high]| (low + high) * 0.5).collect(),
        boxes,
        items: (0..count as u32).collect(),
        links: vec![Link { first: 0, count: 0 }],
        most,
    };
    let depth = builder.node(0, 0..count, 1);
    Built { links: builder.links, items: builder.items, depth }
}

struct Builder {
    boxes: Vec<Bounds>,
    centres: Vec<Vec3A>,
    items: Vec<u32>,
    links: Vec<Link>,
    most: usize,
}

impl Builder {
    /// Builds the subtree of some items, and returns its depth.
    fn node(&mut self, node: usize, range: Range<usize>, depth: usize) -> usize {
        let middle = if range.len() > 1 { self.split(range.clone()) } else { None };
        let Some(middle) = middle else {
            self.links[node] = Link { first: range.start as u32, count: range.len() as u32 };
            return depth;
        };
        let first = self.links.len();
        self.links[node] = Link { first: first as u32, count: 0 };
        self.links.extend([Link { first: 0, count: 0 }; 2]);
        let left = self.node(first, range.start..middle, depth + 1);
        left.max(self.node(first + 1, middle..range.end, depth + 1))
    }

    /// Sorts the items into two parts and returns where the second starts, or `None` for a leaf.
    fn split(&mut self, range: Range<usize>) -> Option<usize> {
        let items = &mut self.items[range.clone()];
        let (boxes, centres) = (&self.boxes, &self.centres);
        let whole = items.iter().fold(NOTHING, |b, &i| joined(b, boxes[i as usize]));
        let [low, high] = items.iter().fold(NOTHING, |b, &i| grown(b, centres[i as usize]));
        let scale = Vec3A::splat(BINS as f32 * 0.9999) / (high - low);
        let mut best: Option<(f32, usize, usize)> = None;
        for axis in (0..3).filter(|&axis| high[axis] > low[axis]) {
            let mut bins = [(NOTHING, 0_usize); BINS];
            for &i in &*items {
                let i = i as usize;
                let bin = &mut bins[((centres[i][axis] - low[axis]) * scale[axis]) as usize];
                *bin = (joined(bin.0, boxes[i]), bin.1 + 1);
            }
            let mut right_cost = [0.0; BINS];
            let mut right = (NOTHING, 0);
            for (cut, bin) in bins.iter().enumerate().rev() {
                right = (joined(right.0, bin.0), right.1 + bin.1);
                right_cost[cut] = area(right.0) * right.1 as f32;
            }
            let mut left = (NOTHING, 0);
            for cut in 1..BINS {
                left = (joined(left.0, bins[cut - 1].0), left.1 + bins[cut - 1].1);
                let cost = area(left.0) * left.1 as f32 + right_cost[cut];
                let both = left.1 > 0 && left.1 < items.len();
                if both && best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, cut));
                }
            }
        }
        let Some((cost, axis, cut)) = best else {
            // All centres coincide.
            return (items.len() > self.most).then_some(range.start + items.len() / 2);
        };
        let leaf_cost = area(whole) * (items.len() as f32 - 2.0 * BOX_COST);
        if items.len() <= self.most && leaf_cost <= cost {
            return None;
        }
        let is_right =
            |&i: &u32| ((centres[i as usize][axis] - low[axis]) * scale[axis]) as usize >= cut;
        items.sort_by_key(is_right);
        Some(range.start + items.partition_point(|i| !is_right(i)))
    }
}

//! The AABB tree, refitted once a frame to that frame and the previous one, for a surface that moves between the two.
//!
//! A box around both ends of a vertex's path contains the whole path, so one refit serves every tick of the period.
//! Corners are interpolated when they are read.

use glam::{Vec3, Vec3A};

use super::aabb_tree::{AabbTree, Bounds, Link, STACK};
use super::boxes::{BoxTree, Node, Start, closest_to};
use crate::method::{Found, Probe};

/// A tree of boxes over two frames.
pub struct Swept {
    tree: AabbTree,
    before: Vec<Vec3A>,
    share: f32,
    start: Start,
}

impl Swept {
    /// Wraps this tree. Searches start from the triangle of the last answer.
    #[must_use]
    pub fn new(tree: AabbTree) -> Self {
        Self { tree, before: Vec::new(), share: 0.0, start: Start::Last(None) }
    }

    /// Loads the next frame. The frame that was loaded last becomes the previous one.
    pub fn load(&mut self, positions: &[Vec3]) {
        self.arriving();
        self.tree.rows.load(positions);
    }

    /// The next frame's positions, for writing. The frame that was written last becomes the previous one.
    pub fn arriving(&mut self) -> &mut [Vec3A] {
        let rows = &mut self.tree.rows;
        rows.swap(&mut self.before);
        rows.positions_mut()
    }

    /// The mesh vertex of a row.
    #[must_use]
    pub fn vertex(&self, row: usize) -> u32 {
        self.tree.rows.vertex(row)
    }

    /// All work of a frame before its first query.
    pub fn update(&mut self) {
        self.tree.refit_over(&self.before);
    }

    /// The closest pair of tool and surface at the fraction `share` of the interval between the two frames.
    pub fn find(&mut self, tool: &Probe, share: f32) -> Found {
        self.share = share;
        let found;
        (found, self.start) = closest_to::<_, STACK>(self, tool, self.start);
        found
    }
}

impl BoxTree for Swept {
    #[inline(always)]
    fn node(&mut self, node: u32) -> Node {
        match self.tree.links[node as usize] {
            Link { first, count: 0 } => Node::Inner(first),
            Link { first, count } => Node::Leaf(first as usize..(first + count) as usize),
        }
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> Bounds {
        self.tree.boxes[node as usize]
    }

    #[inline(always)]
    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.tree.rows.triangle(triangle).map(|row| {
            let (before, after) =
                (self.before[row as usize], self.tree.rows.positions()[row as usize]);
            Vec3::from(before + (after - before) * self.share)
        })
    }
}

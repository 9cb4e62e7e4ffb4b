//! The AABB tree refitted bottom-up at every frame (van den Bergen 1997).

use glam::{Vec3, Vec3A};

use super::aabb_tree::AabbTree;
use super::boxes::Start;
use crate::method::{Found, Layout, Method, Probe};

/// A tree of boxes that are all refitted before the first query of a frame.
pub struct Refit {
    tree: AabbTree,
    start: Start,
}

impl Refit {
    /// Wraps this tree.
    #[must_use]
    pub fn new(tree: AabbTree) -> Self {
        Self { tree, start: Start::Cold }
    }

    /// The same, but every search starts from the triangle of the last answer.
    #[must_use]
    pub fn warm(self) -> Self {
        Self { start: Start::Last(None), ..self }
    }
}

impl Method for Refit {
    fn load(&mut self, positions: &[Vec3]) {
        self.tree.rows.load(positions);
    }

    fn update(&mut self) {
        self.tree.refit(0..self.tree.links.len());
    }

    fn find(&mut self, tool: &Probe) -> Found {
        let never = |_: &mut AabbTree, _| unreachable!("no node is deferred");
        match tool {
            Probe::Sphere(sphere) => self.tree.closest(sphere, &mut self.start, never),
            Probe::Capsule(capsule) => self.tree.closest(capsule, &mut self.start, never),
        }
    }
}

impl Layout for Refit {
    type Position = Vec3A;

    fn positions_mut(&mut self) -> &mut [Vec3A] {
        self.tree.rows.positions_mut()
    }

    fn vertex(&self, row: usize) -> u32 {
        self.tree.rows.vertex(row)
    }
}

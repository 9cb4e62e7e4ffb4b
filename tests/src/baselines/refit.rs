//! The AABB tree refitted bottom-up at every frame (van den Bergen 1997).

use glam::Vec3;

use super::aabb_tree::AabbTree;
use crate::method::{Found, Method, Probe};

/// A tree of boxes, all of them refitted before the first query of a frame.
pub struct Refit {
    tree: AabbTree,
}

impl Refit {
    /// Refits this tree.
    #[must_use]
    pub fn new(tree: AabbTree) -> Self {
        Self { tree }
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
            Probe::Sphere(sphere) => self.tree.closest(sphere, never),
            Probe::Capsule(capsule) => self.tree.closest(capsule, never),
        }
    }
}

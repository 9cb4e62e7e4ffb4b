//! The AABB tree refitted partly before and partly during queries (Larsson and Akenine-Moller 2001).
//!
//! The boxes of the top levels are refitted bottom-up, starting at a *cut* of the tree, where each box is computed from
//! the vertices below it. Each subtree below the cut is refitted when a query first enters it.

use glam::{Vec3, Vec3A};

use super::aabb_tree::{AabbTree, Bounds, DEFERRED, Link, grown, joined};
use super::boxes::Start;
use crate::method::{Found, Layout, Method, Probe};

/// A tree of boxes with a cut.
pub struct Hybrid {
    pub(super) tree: AabbTree,
    /// Inner nodes above the cut, parents first.
    top: Vec<u32>,
    pub(super) cut: Vec<Cut>,
    frame: u64,
    pub(super) start: Start,
}

/// A subtree below the cut.
pub(super) struct Cut {
    node: u32,
    first_child: u32,
    end: u32,
    /// The vertices below the node: the rows from `rows.0` to `rows.1`, and the others.
    rows: (u32, u32),
    others: Vec<u32>,
    /// The last frame for which the descendants were refitted.
    refitted: u64,
}

impl Hybrid {
    /// Wraps this tree, with the cut `level` levels below the root.
    #[must_use]
    pub fn new(mut tree: AabbTree, level: u32) -> Self {
        let (mut top, mut cut) = (Vec::new(), Vec::new());
        let mut waiting = vec![(0_usize, 0)];
        while let Some((node, depth)) = waiting.pop() {
            let Link { first, count } = tree.links[node];
            if count == 0 && depth < level {
                top.push(node as u32);
                waiting.extend([(first as usize, depth + 1), (first as usize + 1, depth + 1)]);
            } else {
                cut.push(Cut::new(&tree, node));
            }
        }
        top.sort_unstable();
        cut.sort_unstable_by_key(|cut| cut.node);
        for (number, cut) in cut.iter().enumerate() {
            let link = &mut tree.links[cut.node as usize];
            if link.count == 0 {
                link.count = DEFERRED | number as u32;
            }
        }
        Self { tree, top, cut, frame: 0, start: Start::Cold }
    }

    /// The same, but every search starts from the triangle of the last answer.
    #[must_use]
    pub fn warm(self) -> Self {
        Self { start: Start::Last(None), ..self }
    }
}

impl Cut {
    fn new(tree: &AabbTree, node: usize) -> Self {
        let below = tree.descendants(node);
        let itself = node..node + 1;
        let vertices = tree.vertices_of(if below.is_empty() { &itself } else { &below });
        // Rows have the order of the leaves: most rows of a subtree are consecutive, and at the end of its list.
        let run = vertices.windows(2).rev().take_while(|pair| pair[0] + 1 == pair[1]).count() + 1;
        let (others, rows) = vertices.split_at(vertices.len() - run);
        Self {
            node: node as u32,
            first_child: below.start as u32,
            end: below.end as u32,
            rows: (rows[0], rows[0] + run as u32),
            others: others.to_vec(),
            refitted: 0,
        }
    }

    /// The vertices below.
    pub fn vertices(&self) -> impl Iterator<Item = u32> {
        (self.rows.0..self.rows.1).chain(self.others.iter().copied())
    }

    /// Whether it is a leaf, which a search does not refit.
    pub const fn is_leaf(&self) -> bool {
        self.first_child == self.end
    }

    pub fn bounds(&self, tree: &AabbTree) -> Bounds {
        let run = &tree.rows.positions()[self.rows.0 as usize..self.rows.1 as usize];
        let start = [run[0]; 2];
        let of_run = run.iter().fold(start, |b, &p| grown(b, p));
        self.others.iter().fold(of_run, |b, &v| grown(b, tree.rows.positions()[v as usize]))
    }
}

impl Method for Hybrid {
    fn load(&mut self, positions: &[Vec3]) {
        self.tree.rows.load(positions);
    }

    fn update(&mut self) {
        self.update_by(|tree, _, cut| cut.bounds(tree));
    }

    fn find(&mut self, tool: &Probe) -> Found {
        self.find_by(tool, |_, _| ())
    }
}

impl Hybrid {
    /// Refits the boxes at and above the cut: `bounds` returns those of each subtree, by index.
    #[inline(always)]
    pub(super) fn update_by(&mut self, bounds: impl Fn(&mut AabbTree, usize, &Cut) -> Bounds) {
        self.frame += 1;
        for (number, cut) in self.cut.iter().enumerate() {
            self.tree.boxes[cut.node as usize] = bounds(&mut self.tree, number, cut);
        }
        for &node in self.top.iter().rev() {
            let first = self.tree.links[node as usize].first as usize;
            self.tree.boxes[node as usize] =
                joined(self.tree.boxes[first], self.tree.boxes[first + 1]);
        }
    }

    /// The closest pair; `enter` is called with each subtree before it is refitted.
    #[inline(always)]
    pub(super) fn find_by(&mut self, tool: &Probe, enter: impl Fn(&mut AabbTree, &Cut)) -> Found {
        let (cuts, frame) = (&mut self.cut, self.frame);
        let refresh = |tree: &mut AabbTree, node: usize| {
            let cut = &mut cuts[(tree.links[node].count & !DEFERRED) as usize];
            if cut.refitted != frame {
                cut.refitted = frame;
                enter(tree, cut);
                tree.refit(cut.first_child as usize..cut.end as usize);
            }
            cut.first_child
        };
        match tool {
            Probe::Sphere(sphere) => self.tree.closest(sphere, &mut self.start, refresh),
            Probe::Capsule(capsule) => self.tree.closest(capsule, &mut self.start, refresh),
        }
    }
}

impl Layout for Hybrid {
    type Position = Vec3A;

    fn positions_mut(&mut self) -> &mut [Vec3A] {
        self.tree.rows.positions_mut()
    }

    fn vertex(&self, row: usize) -> u32 {
        self.tree.rows.vertex(row)
    }
}

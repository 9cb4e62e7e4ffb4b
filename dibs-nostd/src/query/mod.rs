//! The traversal: the closest pair between a tool and the current surface.

// Requirements

mod chain;
mod contacts;
mod corners;
mod cost;
mod cost_m7;
mod cost_nodes;
mod cost_tick;
mod cost_x86_64;
mod depth;
#[cfg(test)]
mod distances;
mod exact;
mod made;
mod memory;
mod normal;
mod options;
mod passed;
mod plane;
mod precision;
mod prices;
mod proximity;
mod search;
mod separation;
mod side;
mod sides;
mod solids;
mod swept;
mod tracker;

pub use chain::Closest;
pub use contacts::{Contact, ContactIter, Contacts};
pub use cost::Cost;
pub use options::{Budget, Options};
pub use proximity::{Interval, Proximity};
#[cfg(feature = "control")]
pub(crate) use search::LabelDistance;
pub use sides::{NoSide, Side};
pub use swept::{Sweep, SweepAnswer};
pub use tracker::{Fallback, Tracker, TrackerAnswer};

use crate::tree::{RootSet, ValidTree};
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, TriangleRow, VertexTable};
#[cfg(feature = "batched")]
use search::BatchedSearch;
use search::{Search, Ties, WHOLE, WaitingNode};
use separation::signed;

/// A query on one tree, with the fixed stack that its traversal needs: 8 bytes an entry.
///
/// `STACK` must be at least [`Tree::stack`], which [`new`](Self::new) checks and the builder prints. Create it once, in
/// a `static` or at start-up, and use it at every tick.
#[derive(Clone, Debug)]
pub struct Query<'t, I, const STACK: usize> {
    tree: Tree<'t, I>,
    stack: [WaitingNode; STACK],
    triangle: Option<TriangleRow>,
    ties: Ties,
}

impl<'t, I: Index, const STACK: usize> Query<'t, I, STACK> {
    /// A query on `tree`, a [`Tree`].
    ///
    /// # Errors
    /// [`QueryError::Stack`] if `STACK` is less than the tree needs.
    pub fn new(tree: &impl ValidTree<'t, I>) -> Result<Self, QueryError> {
        let tree = tree.valid();
        if tree.stack() as usize > STACK {
            return Err(QueryError::Stack { needed: tree.stack(), available: STACK as u32 });
        }
        let stack = [WaitingNode { lower: 0.0, link: 0 }; STACK];
        Ok(Self { tree: *tree, stack, triangle: None, ties: Ties::new() })
    }

    /// The tree that is searched.
    #[must_use]
    pub const fn tree(&self) -> &Tree<'t, I> {
        &self.tree
    }

    /// The closest pair between `tool` and the surface whose vertices are `vertices`.
    ///
    /// Signed if the tree has adjacency: [`Proximity::side`] is the tool's side of the surface.
    ///
    /// Exact within [`Proximity::accuracy`], which includes the surface's position error, while the surface stays
    /// within the stretch limit (or the stretch that it carries, or that of `options`). The search starts from the last
    /// answer's triangle, unless `options` say otherwise. A sphere's pin is a vertex of the surface, so its distance is
    /// an upper bound from the first node on.
    ///
    /// Where a capsule's axis crosses the surface or is inside, up to 27 more searches find the depth, with no more
    /// node tests than the tree has nodes, or 3,072 if that is more. If these do not suffice, the interval is wider
    /// than the tolerance. In a tree with several solids, each solid whose sphere the axis reaches takes its own
    /// search. Where f32 cannot decide the side, f64 does, counted as node tests of equal time; if too many triangles
    /// tie, two more searches follow.
    ///
    /// Cost: the budget at most; typical counts are in the repository's `docs/evidence/benchmarks.md`.
    ///
    /// # Errors
    /// [`QueryError`]: a table of the wrong size, a root pin that is not finite, a stretch measured on another mesh, or
    /// bytes that changed during the query. Running out of budget is no error.
    pub fn closest<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
    ) -> Result<Proximity, QueryError> {
        let search = self.search(vertices, tool, options, options.first(self.triangle))?;
        let found = search.run::<WHOLE>(f32::INFINITY)?;
        self.sided(vertices, tool, options, found)
    }

    /// As [`closest`](Self::closest), in batches of up to seven subtrees: for processors with out-of-order execution
    /// and vector registers.
    ///
    /// It has the same promises, errors and answers (of several triangles at equal distance it may name another) and
    /// usually needs fewer tests. It takes 2 KiB of the call stack, and pays only if `STACK` is [`Tree::stack`] plus
    /// 128; with less, batches are smaller. On a microcontroller `closest` is faster.
    ///
    /// # Errors
    /// Same as [`closest`](Self::closest).
    #[cfg(feature = "batched")]
    pub fn closest_batched<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
    ) -> Result<Proximity, QueryError> {
        let first = options.first(self.triangle);
        let found = BatchedSearch::new(self.search(vertices, tool, options, first)?).run()?;
        self.sided(vertices, tool, options, found)
    }
}

impl<'t, I: Index, const STACK: usize> Query<'t, I, STACK> {
    #[inline(always)]
    fn search<'s, V: VertexTable + ?Sized, T: Tool>(
        &'s mut self,
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        first: Option<TriangleRow>,
    ) -> Result<Search<'s, 't, I, V, T>, QueryError> {
        let (roots, ties) = (RootSet::ALL, Some(&mut self.ties));
        Search::start(roots, &self.tree, &mut self.stack, vertices, tool, options, first, ties)
    }

    /// Adds the side to a search's closest pair.
    #[inline(always)]
    fn sided<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
        mut found: Proximity,
    ) -> Result<Proximity, QueryError> {
        self.triangle = found.triangle.or(self.triangle);
        let memory = (&mut self.ties, None);
        signed(&self.tree, &mut self.stack, vertices, tool, options, &mut found, memory)?;
        found.add_position_error(vertices);
        Ok(found)
    }
}

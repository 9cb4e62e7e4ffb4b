//! The traversal: the closest pair between a tool and the surface as it is now.

mod cost;
mod cost_m7;
mod error;
mod options;
mod search;

pub use cost::Cost;
pub use error::QueryError;
pub use options::{Budget, Options};

use crate::format::Link;
use crate::{Index, Proximity, Tool, Tree, VertexTable};
use search::{Search, Step, Waiting};

/// A query on one tree, with the fixed stack that its traversal needs: 8 bytes an entry.
///
/// `DEPTH` must be at least the tree's depth, checked once, here; [`Tree::depth`] tells it, and the
/// builder prints it. Make it once, in a `static` or at start-up, and use it at every tick.
#[derive(Clone, Debug)]
pub struct Query<'t, I, const DEPTH: usize> {
    tree: Tree<'t, I>,
    stack: [Waiting; DEPTH],
}

impl<'t, I: Index, const DEPTH: usize> Query<'t, I, DEPTH> {
    /// A query on `tree`.
    ///
    /// # Errors
    /// [`QueryError::Depth`] if the stack cannot hold the tree's depth.
    pub const fn new(tree: &Tree<'t, I>) -> Result<Self, QueryError> {
        if tree.depth() as usize > DEPTH {
            return Err(QueryError::Depth { needed: tree.depth(), available: DEPTH as u32 });
        }
        Ok(Self { tree: *tree, stack: [Waiting { lower: 0.0, link: 0 }; DEPTH] })
    }

    /// The tree that is searched.
    #[must_use]
    pub const fn tree(&self) -> &Tree<'t, I> {
        &self.tree
    }

    /// The closest pair between `tool` and the surface whose vertices are `vertices`.
    ///
    /// Exact within [`Proximity::accuracy`] as long as the surface keeps to the stretch limit (or to
    /// the measured stretch in `options`). Pins are vertices of the surface, so their distances are
    /// upper bounds from the first node on. Near child first; squares are compared, and a root is
    /// taken only where an order is needed.
    ///
    /// Cost: the budget at most; typical counts are in `docs/benchmarks.md`.
    ///
    /// # Errors
    /// [`QueryError`]: a table of the wrong size, a root pin that is not finite, a measurement of
    /// another mesh, or bytes that changed under the query. Never because the budget ran out.
    pub fn closest<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
    ) -> Result<Proximity, QueryError> {
        let mut search = Search::start(&self.tree, vertices, tool, options)?;
        let header = self.tree.header();
        let mut waiting = 0usize;
        let mut next = Some(Waiting { lower: search.root_lower, link: header.root });
        while let Some(subtree) = next {
            let deeper = if subtree.lower > search.reach {
                Step::Done
            } else {
                match Link::decode(subtree.link) {
                    Link::Node(row) => search.expand(row, subtree.lower)?,
                    Link::Leaf { first, count } => search.leaf(first, count)?,
                }
            };
            next = match deeper {
                Step::One(near) => Some(near),
                Step::Two(near, far) => {
                    let slot =
                        self.stack.get_mut(waiting).ok_or(QueryError::Corrupt { row: far.link })?;
                    *slot = far;
                    waiting += 1;
                    Some(near)
                }
                Step::Done => match waiting.checked_sub(1) {
                    Some(top) => {
                        waiting = top;
                        self.stack.get(top).copied()
                    }
                    None => None,
                },
                Step::OutOfBudget => {
                    let mut lower = subtree.lower;
                    for left in self.stack.iter().take(waiting) {
                        if left.lower < lower {
                            lower = left.lower;
                        }
                    }
                    return search.finish(lower);
                }
            };
        }
        search.finish(f32::INFINITY)
    }
}

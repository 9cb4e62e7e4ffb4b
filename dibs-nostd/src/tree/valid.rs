//! The trees that a query takes.

use super::{Index, Tree};

/// A validated [`Tree`].
///
/// A trait only for the compiler's message: [`TreeBytes`](crate::TreeBytes) have a call that makes them a tree.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a validated tree",
    label = "call `.validate()` first",
    note = "at start-up `let tree = heart::TREE.validate()?;`, and then `&tree`"
)]
pub trait ValidTree<'t, I> {
    /// The tree.
    fn valid(&self) -> &Tree<'t, I>;
}

impl<'t, I: Index> ValidTree<'t, I> for Tree<'t, I> {
    #[inline(always)]
    fn valid(&self) -> &Self {
        self
    }
}

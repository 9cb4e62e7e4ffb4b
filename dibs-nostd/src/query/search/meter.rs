//! A search's budget, and what is left of it.

use crate::Budget;

/// Counts the tests of a search. A count that the budget does not cover is `None`, and counts nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meter {
    all: Budget,
    left: Budget,
}

impl Meter {
    pub const fn new(all: Budget) -> Self {
        Self { all, left: all }
    }

    /// The same for another number of node tests, of which none was made.
    pub const fn with_nodes(self, node_tests: u32) -> Self {
        Self { all: Budget { node_tests, ..self.all }, left: Budget { node_tests, ..self.left } }
    }

    /// A test of a sphere or plane.
    #[inline(always)]
    pub fn node(&mut self) -> Option<()> {
        self.nodes(1)
    }

    #[inline(always)]
    pub fn nodes(&mut self, count: u32) -> Option<()> {
        self.left.node_tests = self.left.node_tests.checked_sub(count)?;
        Some(())
    }

    /// An exact test of a triangle.
    #[inline(always)]
    pub fn triangle(&mut self) -> Option<()> {
        self.left.triangle_tests = self.left.triangle_tests.checked_sub(1)?;
        Some(())
    }

    /// A test of a triangle's plane, with an exact test to spare that may follow.
    #[inline(always)]
    pub fn triangle_plane(&mut self) -> Option<()> {
        self.left.triangle_tests.checked_sub(1)?;
        self.node()
    }

    /// The exact test that was to spare.
    #[inline(always)]
    pub fn spare_triangle(&mut self) {
        self.left.triangle_tests = self.left.triangle_tests.wrapping_sub(1);
    }

    /// The tests made.
    #[inline(always)]
    pub const fn made(&self) -> Budget {
        self.all.less(self.left.node_tests, self.left.triangle_tests)
    }
}

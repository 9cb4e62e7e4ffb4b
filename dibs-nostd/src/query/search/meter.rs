//! A search's budget, and how much of it is left.

// Requirement: A-05

use crate::Budget;
use crate::query::made::Tests;

/// Counts the tests of a search. If the budget does not cover a test, the call returns `None` and counts nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meter {
    all: u32,
    left: u32,
    triangle_tests: u32,
}

impl Meter {
    pub const fn new(budget: Budget) -> Self {
        Self { all: budget.tests(), left: budget.tests(), triangle_tests: 0 }
    }

    /// The same with another budget, before any test but that of a warm triangle.
    pub const fn within(self, budget: Budget) -> Self {
        let warm = self.triangle_tests.wrapping_mul(Budget::TRIANGLE);
        Self { all: budget.tests().wrapping_add(warm), left: budget.tests(), ..self }
    }

    /// The exact test of a warm triangle. It is not taken off a budget that could cover it, so a larger budget never
    /// leaves less for the rest.
    #[inline(always)]
    pub fn warm_triangle(&mut self) -> Option<()> {
        self.left.checked_sub(Budget::TRIANGLE)?;
        self.all = self.all.wrapping_add(Budget::TRIANGLE);
        self.triangle_tests = self.triangle_tests.wrapping_add(1);
        Some(())
    }

    /// A test of a sphere or plane.
    #[inline(always)]
    pub fn node(&mut self) -> Option<()> {
        self.nodes(1)
    }

    #[inline(always)]
    pub fn nodes(&mut self, count: u32) -> Option<()> {
        self.left = self.left.checked_sub(count)?;
        Some(())
    }

    /// An exact test of a triangle.
    #[inline(always)]
    pub fn triangle(&mut self) -> Option<()> {
        self.nodes(Budget::TRIANGLE)?;
        self.triangle_tests = self.triangle_tests.wrapping_add(1);
        Some(())
    }

    /// A test of a triangle's plane, if the budget also covers the exact test that may follow.
    #[inline(always)]
    pub fn triangle_plane(&mut self) -> Option<()> {
        self.left.checked_sub(1 + Budget::TRIANGLE)?;
        self.node()
    }

    /// The exact test after such a plane test.
    #[inline(always)]
    pub fn spare_triangle(&mut self) {
        self.left = self.left.wrapping_sub(Budget::TRIANGLE);
        self.triangle_tests = self.triangle_tests.wrapping_add(1);
    }

    /// The tests made.
    #[inline(always)]
    pub const fn made(&self) -> Tests {
        let Self { all, left, triangle_tests } = *self;
        let node_tests =
            all.wrapping_sub(left).wrapping_sub(triangle_tests.wrapping_mul(Budget::TRIANGLE));
        Tests { node_tests, triangle_tests }
    }
}

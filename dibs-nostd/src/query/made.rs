//! Tests that were made.

use super::{Budget, Proximity};

/// Numbers of tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tests {
    pub node_tests: u32,
    pub triangle_tests: u32,
}

impl Tests {
    pub const NONE: Self = Self { node_tests: 0, triangle_tests: 0 };

    /// The node tests that take as long.
    pub const fn work(self) -> u32 {
        self.node_tests.saturating_add(self.triangle_tests.saturating_mul(Budget::TRIANGLE))
    }

    /// These and other ones.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            node_tests: self.node_tests.saturating_add(other.node_tests),
            triangle_tests: self.triangle_tests.saturating_add(other.triangle_tests),
        }
    }
}

impl Proximity {
    /// The tests that the answer took.
    pub(super) const fn tests(&self) -> Tests {
        Tests { node_tests: self.node_tests, triangle_tests: self.triangle_tests }
    }

    /// The node tests that take as long as its tests did, which a [`Budget`] bounds: a triangle test counts as
    /// [`Budget::TRIANGLE`]. The first root's test is one of them; it comes on top of the budget, as does
    /// the triangle of a warm start.
    #[must_use]
    pub const fn work(&self) -> u32 {
        self.tests().work()
    }

    /// Counts tests that it took besides.
    pub(super) const fn add_tests(&mut self, made: Tests) {
        let Tests { node_tests, triangle_tests } = self.tests().and(made);
        (self.node_tests, self.triangle_tests) = (node_tests, triangle_tests);
    }
}

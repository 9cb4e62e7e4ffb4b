//! Counts of tests made.

use super::{Budget, Proximity};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tests {
    pub node_tests: u32,
    pub triangle_tests: u32,
}

impl Tests {
    pub const NONE: Self = Self { node_tests: 0, triangle_tests: 0 };

    /// The node tests that take as long as these tests.
    pub const fn work(self) -> u32 {
        self.node_tests.saturating_add(self.triangle_tests.saturating_mul(Budget::TRIANGLE))
    }

    /// The sum of both counts, each far below the largest number.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            node_tests: self.node_tests.wrapping_add(other.node_tests),
            triangle_tests: self.triangle_tests.wrapping_add(other.triangle_tests),
        }
    }
}

impl Proximity {
    /// The answer's test counts.
    pub(super) const fn tests(&self) -> Tests {
        Tests { node_tests: self.node_tests, triangle_tests: self.triangle_tests }
    }

    /// The answer's work in node tests, which a [`Budget`] bounds: a triangle test counts as [`Budget::TRIANGLE`]. It
    /// includes the first root's test and the triangle of a warm start, which the budget does not count.
    #[must_use]
    pub const fn work(&self) -> u32 {
        self.tests().work()
    }

    /// Adds tests made outside of the search.
    pub(super) const fn add_tests(&mut self, made: Tests) {
        let Tests { node_tests, triangle_tests } = self.tests().and(made);
        (self.node_tests, self.triangle_tests) = (node_tests, triangle_tests);
    }
}

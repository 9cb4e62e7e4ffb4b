//! From a deadline to a budget, by a fitted bound on a query's cost.

use super::Budget;

/// A fitted bound on a query's cost: `base + n * node_test + t * triangle_test`, in instructions, where `n`
/// and `t` are the node and triangle tests that a [`Budget`] limits. The budget is exact; the instructions of a
/// test are measured, not proved.
///
/// The constants are the plane above some hundred thousand adversarial queries about four small surfaces, on an
/// emulated Cortex-M7 and on x86-64, plus a margin of 20 %. They are checked on surfaces and poses that the fit has not
/// seen: the repository's `docs/evidence/guarantees.md` lists these, the queries above the bound, its tightness, and the cycles
/// of an instruction. They are for [`Query::closest`](crate::Query::closest), vertex tables that are slices of `Vec3`,
/// and the firmware's profile or an optimised build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cost {
    /// The cost of every query: setting it up, the root, a warm start's bookkeeping, and the answer. Of a tree over
    /// surfaces that share no vertex, each further root adds about a node test.
    pub base: u32,
    /// The cost of a node test: of a sphere, or of a leaf's or triangle's plane.
    pub node_test: u32,
    /// The cost of an exact triangle test, on top of the plane test before it.
    pub triangle_test: u32,
}

impl Cost {
    /// The most instructions, by the fit, of a query within `budget`.
    ///
    /// ```
    /// use dibs_nostd::{Budget, Cost};
    /// let cost = Cost { base: 500, node_test: 60, triangle_test: 400 };
    /// let most = cost.instructions(Budget { node_tests: 100, triangle_tests: 10 });
    /// assert_eq!(most, 10_500);
    /// ```
    #[must_use]
    pub const fn instructions(&self, budget: Budget) -> u64 {
        let nodes = budget.node_tests as u64 * self.node_test as u64;
        let triangles = budget.triangle_tests as u64 * self.triangle_test as u64;
        nodes.saturating_add(triangles).saturating_add(self.base as u64)
    }
}

impl Budget {
    /// The budget of a query that ends within this many instructions, by the fit. Each kind of test gets half of them,
    /// about as an ordinary query spends them. A deadline shorter than [`Cost::base`] gives an empty budget, which
    /// still costs the base.
    ///
    /// ```
    /// use dibs_nostd::{Budget, Cost, Options};
    /// // A quarter of a millisecond at 480 MHz, if an instruction takes a cycle and a half.
    /// let budget = Budget::for_instructions(80_000, &Cost::M7_CAPSULE);
    /// assert!(Cost::M7_CAPSULE.instructions(budget) <= 80_000);
    /// let options = Options::new().budget(budget);
    /// # let _ = options;
    /// ```
    #[must_use]
    pub const fn for_instructions(instructions: u32, cost: &Cost) -> Self {
        let half = instructions.saturating_sub(cost.base) / 2;
        Self {
            node_tests: share(half, cost.node_test),
            triangle_tests: share(half, cost.triangle_test),
        }
    }
}

/// `all / each`; no limit where `each` is 0.
const fn share(all: u32, each: u32) -> u32 {
    match all.checked_div(each) {
        Some(number) => number,
        None => u32::MAX,
    }
}

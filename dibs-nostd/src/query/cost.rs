//! From a deadline to a budget, by a fitted bound on a query's cost.

// Requirement: A-05

use super::Budget;
use crate::tree::PathKind;
use crate::{Index, Tree};

/// A fitted bound on a query's cost: `base + n * node_test + t * triangle_test`, in instructions, where `n` and `t` are
/// the node and triangle tests that an answer counts. A [`Budget`] limits the tests exactly; the instructions of a test
/// are measured, not proved.
///
/// The constants are an upper plane of the costs of some hundred thousand adversarial queries on four small surfaces,
/// on an emulated Cortex-M7 and on x86-64, plus a margin of 20 %. They are checked on surfaces and poses outside of the
/// fit: the repository's `docs/evidence/guarantees.md` lists these, the queries above the bound, its tightness, and the
/// cycles per instruction. They hold for [`Query::closest`](crate::Query::closest), vertex tables that are slices of
/// `Vec3`, and the firmware's profile or an optimised build.
///
/// [`M7_TICK`](Self::M7_TICK) is for the ticks of a tracker, guard or filter, with contacts or without, on a moving surface
/// whose frames have the vertices; [`M7_NODES_TICK`](Self::M7_NODES_TICK) for one that nodes carry, whose vertices are
/// computed when they are read. A tick within a budget also pays for its work between tests, so its instructions follow
/// its tests more closely: the constants are a line above the ticks of a path, plus a margin of 15 %. They do not include
/// a guard's own work. The contacts were those of a tracker [`with_range`](crate::Tracker::with_range), in a list of eight.
/// A tick whose front is full ([`Fallback::Full`](crate::Fallback::Full)) pays as a query; its instructions were not
/// measured. No cost is fitted for the ticks on a surface of [modes](crate::modes).
///
/// Other constants may take the place of these: measured on another processor, or proven, as for one linked program
/// in the repository's `docs/evidence/bound.md`; `base` then includes the price of a root, for each besides the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Cost {
    /// The cost of every query: set-up, the root, the warm start and the answer. In a tree over surfaces that share no
    /// vertex, each further root adds about one node test.
    pub base: u32,
    /// The cost of a node test: of a sphere, or of the plane of a leaf or triangle.
    pub node_test: u32,
    /// The cost of an exact triangle test, on top of the plane test before it.
    pub triangle_test: u32,
}

impl Cost {
    /// The cost of a tick on a tree's surface, on a Cortex-M7: [`M7_NODES_TICK`](Self::M7_NODES_TICK) if nodes carry it,
    /// [`M7_TICK`](Self::M7_TICK) if frames have its vertices.
    #[must_use]
    pub const fn of_tick<I: Index>(tree: &Tree<'_, I>) -> Self {
        match tree.paths() {
            PathKind::Volume => Self::M7_NODES_TICK,
            _ => Self::M7_TICK,
        }
    }

    /// An upper bound by the fit on the instructions of a query with this many tests.
    ///
    /// ```
    /// use dibs_nostd::Cost;
    /// let cost = Cost { base: 500, node_test: 60, triangle_test: 400 };
    /// assert_eq!(cost.instructions(100, 10), 10_500);
    /// ```
    #[must_use]
    pub const fn instructions(&self, node_tests: u32, triangle_tests: u32) -> u64 {
        let nodes = node_tests as u64 * self.node_test as u64;
        let triangles = triangle_tests as u64 * self.triangle_test as u64;
        nodes.saturating_add(triangles).saturating_add(self.base as u64)
    }

    /// An upper bound by the fit on the instructions of a query within `budget`, for any mix of node and triangle
    /// tests.
    #[must_use]
    pub const fn instructions_within(&self, budget: Budget) -> u64 {
        // With the triangle of a warm start.
        let most = (budget.tests() as u64 + Budget::TRIANGLE as u64) * self.unit() as u64;
        most.saturating_add(self.base as u64)
    }

    /// The largest cost per node test of a budget, in instructions.
    const fn unit(&self) -> u32 {
        let triangle = self.triangle_test.div_ceil(Budget::TRIANGLE);
        if self.node_test > triangle { self.node_test } else { triangle }
    }
}

impl Budget {
    /// The largest budget with which a query ends within this many instructions, by the fit. A deadline shorter than
    /// [`Cost::base`] gives an empty budget, which still costs the base.
    ///
    /// ```
    /// use dibs_nostd::{Budget, Cost, Options};
    /// // A quarter of a millisecond at 480 MHz, if an instruction takes a cycle and a half.
    /// let budget = Budget::for_instructions(80_000, &Cost::M7_CAPSULE);
    /// assert!(Cost::M7_CAPSULE.instructions_within(budget) <= 80_000);
    /// let options = Options::new().budget(budget);
    /// # let _ = options;
    /// ```
    #[must_use]
    pub const fn for_instructions(instructions: u32, cost: &Cost) -> Self {
        match instructions.saturating_sub(cost.base).checked_div(cost.unit()) {
            // The triangle of a warm start is not counted in the budget.
            Some(tests) => Self::new(tests.saturating_sub(Self::TRIANGLE)),
            // Tests cost nothing.
            None => Self::UNLIMITED,
        }
    }
}

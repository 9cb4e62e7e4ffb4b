//! A query's options: prior knowledge and a budget.

use super::made::Tests;
use crate::{Coverage, MeasuredStretch, TriangleRow, VertexTable};

/// The default tolerance of a depth, as a fraction of the axis' length.
const TOLERANCE: f32 = 1.0 / 512.0;

/// The least default tolerance, in units of the accuracy: about a hundredth of a millimetre on a heart.
const LEAST_TOLERANCE: f32 = 32.0;

/// The work limit of one query, in node tests. It bounds the query's time; an answer that was cut short is still valid,
/// with a wider interval.
///
/// A node test is that of a sphere, or of the plane of a leaf or triangle. An exact triangle test counts as
/// [`TRIANGLE`](Self::TRIANGLE) node tests. The tests of the roots' spheres and of a warm start's triangle are not
/// counted. The depth of an axis that crosses or is inside counts its work outside of searches as node tests of equal
/// time. A tracker's tick within a budget counts all of its work so, its contacts' too, but a constant part and a
/// comparison for each opened node; without a budget it counts tests alone.
///
/// Every answer's interval holds the true separation. For the same query a larger budget never lowers the lower end,
/// and raises the upper end by no more than the accuracy. From tick to tick only the upper end keeps this rule, if the
/// answer's triangle is the next warm start and nothing has moved: the warm start uses up a test, so the lower end of
/// an answer that is cut short again may fall, by centimetres. Take the larger of two lower ends only for the same
/// frame and pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Budget {
    tests: u32,
}

impl Budget {
    /// No limit.
    pub const UNLIMITED: Self = Self { tests: u32::MAX };

    /// An exact triangle test counts as this many node tests.
    pub const TRIANGLE: u32 = 8;

    /// A budget of this many node tests.
    #[must_use]
    pub const fn new(tests: u32) -> Self {
        Self { tests }
    }

    /// The number of node tests.
    #[must_use]
    pub const fn tests(self) -> u32 {
        self.tests
    }

    pub(super) const fn at_most(self, most: u32) -> Self {
        if self.tests < most { self } else { Self { tests: most } }
    }

    /// The budget left after this many node tests.
    pub(super) const fn less(self, tests: u32) -> Self {
        Self { tests: self.tests.saturating_sub(tests) }
    }
}

/// Prior knowledge for a query, and its budget. Prior knowledge changes the cost, not the answer; a budget may widen
/// the interval.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Options {
    pub(super) budget: Budget,
    /// Whether the budget is the user's own: then a tracker's tick also counts its work [between tests](super::prices).
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) is_priced: bool,
    #[cfg_attr(feature = "serde", serde(skip))]
    first: First,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(super) stretch: Option<MeasuredStretch>,
    pub(super) is_signed: bool,
    pub(super) depth_tolerance: Option<f32>,
    pub(super) part: Option<u8>,
}

/// The triangle that a query tests first (warm start).
#[derive(Clone, Copy, Debug)]
enum First {
    /// The last answer's triangle.
    Last,
    /// None.
    Cold,
    /// A given triangle.
    Triangle(TriangleRow),
}

impl Default for Options {
    fn default() -> Self {
        Self::new()
    }
}

impl Options {
    /// No budget; a warm start from the query's last answer; the stretch that the surface carries, or else the tree's
    /// limit.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            budget: Budget::UNLIMITED,
            is_priced: false,
            first: First::Last,
            stretch: None,
            is_signed: true,
            depth_tolerance: None,
            part: None,
        }
    }

    /// The same options with a cold start: neither answer nor cost depends on earlier queries.
    #[must_use]
    pub const fn cold() -> Self {
        Self::new().warm_start(None)
    }

    /// Bounds the work.
    #[must_use]
    pub const fn budget(mut self, budget: Budget) -> Self {
        self.is_priced = budget.tests < Budget::UNLIMITED.tests;
        self.within(budget)
    }

    /// The same options with another budget, for a part of the work.
    pub(crate) const fn within(mut self, budget: Budget) -> Self {
        self.budget = budget;
        self
    }

    /// Whether the budget covers this work besides tests, or it has no price.
    pub(super) const fn covers(&self, price: u32) -> bool {
        !self.is_priced || self.budget.tests >= price
    }

    /// The same options with a budget of tests alone.
    pub(super) const fn unpriced(mut self) -> Self {
        self.is_priced = false;
        self
    }

    /// The same options with the budget left after these tests.
    pub(super) const fn after(self, made: Tests) -> Self {
        self.within(self.budget.less(made.work()))
    }

    /// Starts from this triangle instead of the last answer's. A wrong or outdated one costs one triangle test; `None`
    /// starts cold.
    #[must_use]
    pub const fn warm_start(mut self, triangle: Option<TriangleRow>) -> Self {
        self.first = match triangle {
            Some(triangle) => First::Triangle(triangle),
            None => First::Cold,
        };
        self
    }

    /// The triangle to test first, for a query whose last answer was on the triangle `last`.
    pub(super) const fn first(&self, last: Option<TriangleRow>) -> Option<TriangleRow> {
        match self.first {
            First::Last => last,
            First::Cold => None,
            First::Triangle(triangle) => Some(triangle),
        }
    }

    /// The source of the stretch in a search with these options.
    pub(super) fn coverage<V: VertexTable + ?Sized>(&self, vertices: &V) -> Coverage {
        let measured = self.stretch.or_else(|| vertices.stretch());
        measured.map_or(Coverage::Assumed, |measured| measured.coverage())
    }

    /// Leaves the side out: the separation is computed as if the tool were outside, at the cost of the distance alone.
    #[must_use]
    pub const fn unsigned(mut self) -> Self {
        self.is_signed = false;
        self
    }

    /// Asks for the side, even after [`unsigned`](Self::unsigned).
    #[cfg(feature = "control")]
    pub(crate) const fn signed(mut self) -> Self {
        self.is_signed = true;
        self
    }

    /// Largest width (mm) of the certified interval where the tool's axis crosses the surface or is inside; by default
    /// a 512th of the axis' length, at least 32 times the accuracy. A smaller width takes more tests. A width above the
    /// axis' length gives the side without a depth, at the cost of the closest pair.
    #[must_use]
    pub const fn depth_tolerance(mut self, tolerance: f32) -> Self {
        self.depth_tolerance = Some(tolerance);
        self
    }

    /// The default [`depth_tolerance`](Self::depth_tolerance) (mm) for an axis of this length (mm) and an answer of this
    /// accuracy (mm).
    #[must_use]
    pub fn default_depth_tolerance(axis_length: f32, accuracy: f32) -> f32 {
        let (whole, least) = (axis_length * TOLERANCE, LEAST_TOLERANCE * accuracy);
        if whole > least { whole } else { least }
    }

    /// Lists only contacts of the triangles with this [label](crate::Tree::label), as if there were no others: the
    /// locally closest pairs of that part of the surface. So a label's margin holds next to a nearer part. The closest
    /// pair and the side are those of the whole surface. Where the tool is inside or crossing, its deepest pair is
    /// listed under its own triangle's label.
    #[must_use]
    pub const fn contacts_of(mut self, label: u8) -> Self {
        self.part = Some(label);
        self
    }

    /// Uses this stretch, measured on the searched frame, instead of the surface's own
    /// ([`VertexTable::stretch`](crate::VertexTable::stretch)). It gives smaller spheres than the tree's limit, so
    /// fewer tests.
    #[must_use]
    pub const fn stretch(mut self, measured: MeasuredStretch) -> Self {
        self.stretch = Some(measured);
        self
    }
}

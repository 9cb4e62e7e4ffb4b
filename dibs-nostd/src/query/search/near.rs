//! All locally lowest triangles within a distance, instead of the closest.

// Requirements: C-05, S-04

use super::heights::{CacheSlot, Heights};
use super::meter::Meter;
use super::node::RANGE;
use super::{Search, WaitingNode};
use crate::math::order::smaller;
use crate::math::sqrt::sqrt;
use crate::query::made::Tests;
use crate::query::prices::{CHILD, LIST};
use crate::tool::{AxisPair, Tool};
use crate::tree::MAX_RING;
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Budget, Index, Options, VertexTable};

/// How far a label's triangles are from a tool's axis.
#[cfg(feature = "control")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct LabelDistance {
    /// None of them is nearer.
    pub distance: f32,
    /// The closest one that was tested, if one was within the limit.
    pub pair: Option<AxisPair>,
    pub node_tests: u32,
    pub triangle_tests: u32,
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// A search over a range, with the budget of `options`.
    ///
    /// In a sound tree it tests each node's sphere once. It reads each triangle once, the vertex beyond one of its
    /// edges, and its side, and tests it exactly at most twice. Each triangle represents at most one vertex, around
    /// which at most [`MAX_RING`] triangles are visited once. So this bound is never reached; if corrupt bytes form a
    /// loop, it ends the search. Prices at most double it.
    pub fn over_range(mut self, options: &Options) -> Self {
        let header = self.tree.header();
        let most = 2 * (3 + MAX_RING + 2 * Budget::TRIANGLE);
        let most = header.triangles.saturating_mul(most).saturating_add(header.nodes);
        self.meter = Meter::new(options.budget.at_most(most));
        self
    }

    /// Visits, with its pair, every triangle within `limit` of the axis that may be a local minimum, ignoring
    /// prominences up to `prominence`. A visit returns the next limit. Returns a lower bound on the distance of unvisited triangles;
    /// the tests made are in `budget`. With a label in the options, only that part of the surface is visited.
    pub fn each_low(
        mut self,
        limit: f32,
        (prominence, options): (f32, &Options),
        mut visit: impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<(f32, Tests), QueryError> {
        self.set_limit(limit);
        if self.pay(options.is_priced, LIST).is_none() {
            return Ok((0.0, self.meter.made()));
        }
        let mut heights = Heights::new(options);
        let least = match self.visit_waiting(prominence, &mut heights, &mut visit)? {
            Some(waiting) => {
                let candidate = least_candidate(&heights, prominence);
                smaller(waiting, candidate)
            }
            None if self.visit_rest(&heights, &mut visit)? => f32::INFINITY,
            None => least_candidate(&heights, prominence),
        };
        Ok((least, self.meter.made()))
    }

    /// The closest of a label's triangles within `limit`.
    #[cfg(feature = "control")]
    #[cold]
    pub fn closest_of_label(
        mut self,
        (label, limit): (u8, f32),
        options: &Options,
    ) -> Result<LabelDistance, QueryError> {
        let (accuracy, tilt) = (self.accuracy(), self.tilt_slack);
        let limit = limit + 2.0 * accuracy;
        let (mut nearest, mut closest) = (limit, None);
        let visit = |_, pair: &AxisPair| {
            let distance = sqrt(pair.distance_squared);
            if distance < nearest {
                (nearest, closest) = (distance, Some(*pair));
            }
            nearest
        };
        // Its other work is in its tests' price: unlike a list's search, it leaves most triangles out by their label.
        let (beyond, tests) = match self.pay(options.is_priced, LIST) {
            Some(()) => self.each_low(limit, (0.0, &Options::new().contacts_of(label)), visit)?,
            None => (0.0, self.meter.made()),
        };
        // A triangle that represents its lowest corner may be lower by the rounding of its tilt.
        let square = beyond * beyond - tilt;
        // A bound below zero is none, and neither is one that is not a number.
        let beyond = if beyond > 0.0 && square > 0.0 { sqrt(square) } else { 0.0 };
        let nearest = smaller(nearest, beyond);
        let Tests { node_tests, triangle_tests } = tests;
        Ok(LabelDistance {
            distance: nearest - accuracy,
            pair: closest,
            node_tests,
            triangle_tests,
        })
    }

    /// Visits the triangles of the waiting subtrees. If the budget runs out, returns a lower bound on the distance of
    /// the rest.
    #[inline(always)]
    pub(super) fn visit_waiting(
        &mut self,
        prominence: f32,
        heights: &mut Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<Option<f32>, QueryError> {
        while let Some(WaitingNode { lower, link }) = self.pop() {
            if lower > self.cutoff {
                continue;
            }
            let link = NodeLink::decode(link);
            let (NodeLink::Children { count, .. } | NodeLink::Leaf { count, .. }) = link;
            let price = match link {
                NodeLink::Children { .. } if heights.is_priced => (1 + CHILD) * count,
                NodeLink::Children { .. } => count,
                NodeLink::Leaf { .. } => heights.price_of(count),
            };
            let is_done = self.meter.nodes(price).is_some()
                && match link {
                    NodeLink::Children { first, count } => {
                        self.expand::<RANGE>(lower, first, count, 0.0)?;
                        true
                    }
                    NodeLink::Leaf { first, count } => {
                        self.visit_low(first, count, prominence, heights, visit)?.is_some()
                    }
                };
            if !is_done {
                return Ok(Some(self.least_waiting(lower)));
            }
        }
        Ok(None)
    }

    /// Visits the triangles that still represent a vertex. Returns `false` if the budget ran out.
    #[inline(always)]
    pub(super) fn visit_rest(
        &mut self,
        heights: &Heights,
        visit: &mut impl FnMut(u32, &AxisPair) -> f32,
    ) -> Result<bool, QueryError> {
        for slot in CacheSlot::all() {
            let vertex = heights.at(slot);
            if vertex.candidate().is_some() && !self.visit_candidate(vertex, heights, visit)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Pays for work besides tests, if it has a price. `None` if the budget does not cover it.
    #[inline(always)]
    pub(super) fn pay(&mut self, is_priced: bool, price: u32) -> Option<()> {
        if is_priced { self.meter.nodes(price) } else { Some(()) }
    }

    pub(super) fn set_limit(&mut self, limit: f32) {
        self.cutoff = limit + self.slack;
        self.cutoff_squared = self.cutoff * self.cutoff;
    }
}

/// Lower bound on the distances of the triangles that represent a vertex: they reach at most half the prominence below
/// it.
pub(super) fn least_candidate(heights: &Heights, prominence: f32) -> f32 {
    sqrt(heights.least_candidate()) - 0.5 * prominence
}

#[cfg(test)]
mod tests {
    use dibs_build::{Builder, generate};

    use super::*;
    use crate::format::MAX_STACK;
    use crate::tree::RootSet;
    use crate::{Sphere, Tree};

    /// No leaf is within the range, so that only children are tested.
    #[test]
    fn within_a_budget_a_child_costs_more_than_its_test() {
        let mesh = generate::heart(5_000).expect("a valid size").mesh;
        let built = Builder::new().stretch(1.1).build(&mesh).expect("builds");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let (pin, ..) = tree.node(0).expect("a root");
        let centre = rows[pin as usize].normalize() * 1_000.0;
        let nearest = rows.iter().map(|row| row.distance(centre)).fold(f32::INFINITY, f32::min);
        let limit = nearest - 40.0;
        let tool = Sphere::new(centre, 1.0).expect("finite");
        let mut stack = [WaitingNode { lower: 0.0, link: 0 }; MAX_STACK];
        let mut made = |options: &Options| {
            let (all, rows) = (RootSet::ALL, rows.as_slice());
            let search = Search::start(all, &tree, &mut stack, rows, &tool, options, None, None);
            let found = search.expect("valid").each_low(limit, (0.1, options), |_, _| limit);
            found.expect("an answer").1
        };
        let tests = made(&Options::cold());
        assert!(tests.node_tests > 0 && tests.triangle_tests == 0, "{tests:?}");
        let paid = made(&Options::cold().budget(Budget::new(1_000_000)));
        let node_tests = LIST + (1 + CHILD) * tests.node_tests;
        assert_eq!(paid, Tests { node_tests, ..tests });
    }
}

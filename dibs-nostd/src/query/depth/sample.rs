//! The search of one point of the axis.
//!
//! A tracker remembers the leaves around the deepest point, so that the next ticks search only these. If a budget ends
//! the search of a point, the next tick continues it: subtrees and leaves keep their bounds, less the motion.

use super::part::{Fit, Parts, Sample};
use super::{Depth, EXACT};
use crate::math::order::smaller;
use crate::query::memory::depth::RememberedDepth;
use crate::query::prices::TIE;
use crate::query::search::{Search, UNTIL};
use crate::query::side::{self, AxisPlace, COORDINATES, PointSide};
use crate::query::sides::{NoSide, Side};
use crate::query::{Options, Proximity};
use crate::tool::{AxisPoint, Tool};
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// The work for a point of the axis outside of its search, in node tests. Without it a budget would not bound a
/// tracker's tick, which may visit many points and triangles without a search.
pub(super) const SAMPLE_COST: u32 = 16;

/// With this many node tests left, a search is expected to finish within a tick.
const ONE_TICK: u32 = 768;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'_, '_, I, V, T> {
    /// Completes the search of the last tick's deepest point; the leaves around it are remembered.
    pub(super) fn measure_again(
        &mut self,
        parts: &mut Parts,
        last: Option<f32>,
    ) -> Result<(), QueryError> {
        let row = last.and_then(|at| parts.row_of(at));
        let length = self.tool.axis_length();
        if let Some(RememberedDepth { leaves: [best, _], waiting, .. }) = &mut self.remembered {
            match row {
                Some(row) => best.move_to(parts.sample(row).parameter, length),
                None => best.end(waiting),
            }
        }
        if let Some(row) = row {
            let sample = self.measure(parts.sample(row), EXACT)?;
            parts.set_sample(row, sample);
        }
        Ok(())
    }

    /// Continues the search of the point that the last tick's budget ended.
    #[cold]
    #[inline(never)]
    pub(super) fn go_on(&mut self, parts: &mut Parts) -> Result<(), QueryError> {
        let Some(searched) = self.searched() else { return Ok(()) };
        match parts.row_of(searched) {
            Some(row) => {
                let sample = self.measure(parts.sample(row), EXACT)?;
                parts.set_sample(row, sample);
            }
            None => self.end_search(),
        }
        Ok(())
    }

    /// Drops the search to be continued in the next tick.
    #[cold]
    fn end_search(&mut self) {
        if let Some(RememberedDepth { leaves: [_, other], waiting, .. }) = &mut self.remembered {
            other.end(waiting);
        }
    }

    /// The closest pair of a sample's point, or the part found before the budget ended; `None` if another search must
    /// be continued first.
    fn search(
        &mut self,
        sample: &Sample,
        options: &Options,
        enough: f32,
    ) -> Result<Option<Proximity>, QueryError> {
        let &Sample { parameter, triangle, .. } = sample;
        let point = AxisPoint(sample.on_axis);
        let length = self.tool.axis_length();
        let Self { roots, tree, stack, vertices, ties, remembered, is_priced, .. } = self;
        let is_priced = *is_priced;
        let search = Search::start(
            *roots,
            tree,
            stack,
            *vertices,
            &point,
            options,
            triangle,
            Some(&mut **ties),
        )?;
        let mut limit = enough;
        if let Some(RememberedDepth { leaves: [best, other], waiting, .. }) = remembered {
            for leaves in [&mut *best, &mut *other] {
                let distance = leaves.distance_to(parameter, length);
                if search.is_among(leaves, distance) {
                    return search.among(leaves, distance, is_priced).map(Some);
                }
            }
            let gathered = match (best.are_around(parameter), other.are_around(parameter)) {
                (true, _) => Some(&mut *best),
                (false, true) => Some(&mut *other),
                (false, false) if !waiting.is_empty() || !other.parameter().is_nan() => {
                    return Ok(None);
                }
                (false, false) if options.budget.tests() >= ONE_TICK => None,
                (false, false) => {
                    other.forget_for(parameter);
                    Some(&mut *other)
                }
            };
            if let Some(gathered) = gathered {
                if !waiting.is_empty() && !gathered.is_gathering() {
                    return Ok(None);
                }
                return search.gather(gathered, waiting, is_priced).map(Some);
            }
            // No early end: a bound that barely suffices now would not at the next tick.
            limit = EXACT;
        }
        let found = search.run::<UNTIL>(limit)?;
        if found.is_cut_short()
            && let Some(RememberedDepth { leaves: [_, other], .. }) = remembered
        {
            other.forget_for(parameter);
        }
        Ok(Some(found))
    }

    /// Searches a point of the axis. Out of budget, returns the sample unchanged. Only a tracker completes the search
    /// of a point no deeper than `enough`.
    #[inline(never)] // Small code, see `side::of_point`.
    pub(super) fn measure(&mut self, sample: Sample, enough: f32) -> Result<Sample, QueryError> {
        self.samples += 1;
        self.spend(SAMPLE_COST);
        let Sample { parameter, on_axis, .. } = sample;
        // The budget must cover the root's test.
        if self.is_spent() {
            return Ok(sample);
        }
        let options = self.options.within(self.options.budget.less(1));
        let point = AxisPoint(on_axis);
        let Some(mut found) = self.search(&sample, &options, enough)? else { return Ok(sample) };
        if found.is_cut_short() && self.has_leaves(parameter) {
            // The leaves were collected over several ticks.
            let (first, rest) = (found.tests(), options.after(found.tests()));
            if let Some(again) = self.search(&sample, &rest, enough)? {
                found = again;
                found.add_tests(first);
            }
        }
        let (tree, vertices, roots) = (self.tree, self.vertices, self.roots);
        let is_many = self.ties.are_missing() && !found.is_cut_short();
        let many = is_many
            .then(|| {
                side::of_many(roots, tree, self.stack, vertices, &mut found, on_axis, &options)
            })
            .transpose()?;
        self.options.budget = self.options.budget.less(found.tests().work());
        self.answer.add_tests(found.tests());
        let distance = found.axis_distance;
        let mut is_cut = found.is_cut_short();
        if self.is_priced {
            self.spend(TIE * self.ties.count());
            is_cut |= self.is_spent();
        }
        let at = if is_cut {
            None
        } else {
            let (at, left) = (AxisPlace::new(&point, 0.0), self.options.budget.tests());
            Some(side::of_point(tree, vertices, &found, &at, self.ties, many, left)?)
        };
        if let Some(PointSide { work: work @ 1.., .. }) = at {
            self.spend(work);
        }
        let mut is_deepest = false;
        let answer = &mut self.answer;
        let depth = match at {
            Some(at) if at.side == Side::Outside => {
                self.touches.add_outside(parameter * self.tool.axis_length());
                -distance
            }
            Some(at) if at.side == Side::Inside && distance > self.deepest => {
                (self.deepest, self.deepest_at) = (distance, parameter);
                *answer = Proximity {
                    point_on_surface: found.point_on_surface,
                    point_on_tool: on_axis - at.outward * self.tool.radius(),
                    direction: at.outward,
                    axis_parameter: parameter,
                    triangle: found.triangle,
                    corners: found.corners,
                    barycentric: found.barycentric,
                    ..*answer
                };
                is_deepest = true;
                distance
            }
            Some(_) => distance,
            None => smaller(distance, sample.depth),
        };
        let accuracy = found.accuracy + COORDINATES * on_axis.abs().max_element();
        if accuracy > answer.accuracy {
            answer.accuracy = accuracy;
        }
        // If its side is unknown, the point is searched again among its leaves.
        if at.is_some_and(|at| at.side != Side::Undefined(NoSide::CutShort)) {
            self.end_search_of(parameter, is_deepest);
        }
        // Without a triangle, its corners repeat a pin.
        let triangle = found.triangle.or(sample.triangle);
        let sample = self.sample(parameter, depth, triangle, found.corners)?;
        let fit = if at.is_some() { Fit::Searched } else { sample.fit };
        Ok(Sample { fit, ..sample })
    }

    /// Whether the leaves around a point are collected.
    fn has_leaves(&self, parameter: f32) -> bool {
        let leaves = self.remembered.as_ref().map(|known| known.leaves.iter());
        leaves.is_some_and(|mut leaves| {
            leaves.any(|leaves| leaves.are_around(parameter) && leaves.are_complete())
        })
    }

    /// Ends the completed search of a point. If it is the deepest, its leaves are kept.
    fn end_search_of(&mut self, parameter: f32, is_deepest: bool) {
        let Some(RememberedDepth { leaves: [best, other], .. }) = &mut self.remembered else {
            return;
        };
        if other.are_around(parameter) {
            if is_deepest {
                core::mem::swap(best, other);
            }
            self.end_search();
        }
    }
}

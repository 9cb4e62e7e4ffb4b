//! The depth of a capsule's axis that crosses the surface or is inside: the largest depth of any of its points.
//!
//! The depth along the axis, positive inside and negative outside, changes by at most the length moved, and is at most
//! the distance to any one triangle of the surface. That distance is convex along the axis, so the triangles closest to
//! two points bound the depth between them. The search divides the part of the axis with the highest bound (Piyavskii
//! and Shubert, with this second bound added) until no part can be deeper than the deepest point found by more than the
//! tolerance. Between two intersections with the surface the axis stays on one side; parts outside are not searched. A
//! few steps from the triangles of the neighbouring points often find a triangle that proves a point to be no deeper.
//! Such a point is not searched.
//!
//! The work is bounded by 1.5 node tests for each of the tree's nodes, or 4,608 if that is more; then the search ends
//! with the interval so far.
//!
//! A tracker keeps the bounds. Tool and surface change a depth by at most their motion, so the next tick searches only
//! parts whose bounds now exceed the deepest point by more than the tolerance.
//!
//! One file, because the search and its steps share one state.

// Requirement: S-03

mod part;
mod sample;
mod start;
mod touches;
mod walk;

use glam::Vec3;

use super::corners::positions;
use super::memory::depth::{Point, Points, RememberedDepth};
use super::prices::TURN;
use super::search::{Ties, WaitingNode};
use super::side;
use super::sides::{NoSide, Side};
use super::{Options, Proximity};
use crate::math::order::{larger, smaller};
use crate::tool::Tool;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tree, TriangleRow, VertexTable};
use part::{Bound, Fit, MOST_DISTANCES, Part, Parts, Sample};
use sample::SAMPLE_COST;
use touches::Touches;

/// A limit that never ends a search early.
const EXACT: f32 = f32::NEG_INFINITY;

/// Most points of the axis that are searched.
const MOST_SAMPLES: u32 = 27;

/// Node tests that any depth may take, however small the tree.
const LEAST_WORK: u32 = 4_608;

/// Node tests that take as long as a point's distance to one triangle.
const DISTANCE_COST: u32 = 3;

/// The most for a bound between two points.
const BOUND_COST: u32 = MOST_DISTANCES * DISTANCE_COST;

/// The search for the deepest point of a tool's axis.
pub(super) struct Depth<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    stack: &'s mut [WaitingNode],
    vertices: &'s V,
    tool: &'s T,
    /// With the remaining budget of the query.
    options: Options,
    /// The closest pair; if the axis crosses, it is on the surface.
    closest: &'s Proximity,
    is_inside: bool,
    /// The intersections of the axis with the surface.
    touches: Touches,
    /// The deepest point so far.
    answer: Proximity,
    deepest: f32,
    /// Its parameter; NaN if no point is inside.
    deepest_at: f32,
    samples: u32,
    remembered: Option<RememberedDepth<'s>>,
    /// Whether a tick's [work besides its tests](super::prices) counts.
    is_priced: bool,
    /// Roots of the shells that decide.
    roots: RootSet,
    /// The triangles that the axis may touch; then those that may be the closest to the last searched point.
    ties: &'s mut Ties,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'s, 't, I, V, T> {
    /// A search below some roots, for a tool whose axis meets the surface in the pair `closest`, or is inside by that
    /// pair's side.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        tree: &'s Tree<'t, I>,
        stack: &'s mut [WaitingNode],
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        closest: &'s Proximity,
        remembered: Option<RememberedDepth<'s>>,
        roots: RootSet,
        ties: &'s mut Ties,
    ) -> Self {
        let mut options = *options;
        options.stretch = options.stretch.or_else(|| vertices.stretch());
        let nodes = tree.header().nodes;
        let most = nodes.saturating_add(nodes / 2).max(LEAST_WORK);
        options.budget = options.after(closest.tests()).budget.at_most(most);
        let is_inside = closest.side == Side::Inside;
        let (deepest, deepest_at) = if is_inside {
            (closest.axis_distance, closest.axis_parameter)
        } else {
            (0.0, f32::NAN)
        };
        Self {
            tree,
            stack,
            vertices,
            tool,
            options,
            closest,
            is_inside,
            touches: Touches::anywhere(),
            answer: *closest,
            deepest,
            deepest_at,
            samples: 0,
            is_priced: options.is_priced && remembered.is_some(),
            remembered,
            roots,
            ties,
        }
    }

    /// The answer with side, signed separation, and the deepest point's pair.
    pub fn run(&mut self) -> Result<Proximity, QueryError> {
        let (length, accuracy) = (self.tool.axis_length(), self.closest.accuracy);
        let default = Options::default_depth_tolerance(length, accuracy);
        let tolerance = self.options.depth_tolerance.unwrap_or(default);
        let reach = self.reach();
        if reach <= self.enough(tolerance) {
            if let Some(RememberedDepth { points, .. }) = &mut self.remembered {
                points.forget();
            }
            return self.finish(reach);
        }
        self.find_touches()?;
        let mut parts = Parts::new();
        let last = self.resume(&mut parts, reach);
        if last.is_none() {
            self.begin(&mut parts, reach, tolerance)?;
        }
        let bound = self.divide(&mut parts, tolerance, last)?;
        // If no search of a point was completed, the next tick searches the last tick's deepest point first.
        let deepest = if self.deepest_at.is_nan() { last } else { Some(self.deepest_at) };
        self.keep(&mut parts, deepest.unwrap_or(f32::NAN));
        self.finish(bound)
    }

    fn keep(&mut self, parts: &mut Parts, deepest: f32) {
        let Some(searched) = self.searched() else { return };
        while parts.count() > Points::MOST && parts.join([deepest, searched], f32::INFINITY) {}
        let point = |Part { from, bound, .. }: Part| {
            let Sample { parameter, depth, triangle, .. } = from;
            Some(Point { parameter, depth, bound, triangle: triangle? })
        };
        if let Some(RememberedDepth { points, .. }) = &mut self.remembered {
            points.keep(parts.in_order().map(point), deepest);
        }
    }

    /// The point that a tracker will search next; NaN if there is none.
    fn searched(&self) -> Option<f32> {
        let RememberedDepth { leaves: [_, other], .. } = self.remembered.as_ref()?;
        Some(other.parameter())
    }

    /// Upper bound on the depth of any point of the axis, by its distance from the closest point.
    fn reach(&self) -> f32 {
        let (length, closest) = (self.tool.axis_length(), self.closest);
        let along = closest.axis_parameter * length;
        let reach = larger(length - along, along) + closest.axis_distance + closest.accuracy;
        self.remembered.as_ref().map_or(reach, |known| smaller(known.between[1], reach))
    }

    /// Searches the last tick's deepest point, then divides the part with the highest bound until none exceeds the
    /// deepest point by more than the tolerance. Returns the highest bound.
    fn divide(
        &mut self,
        parts: &mut Parts,
        tolerance: f32,
        last: Option<f32>,
    ) -> Result<f32, QueryError> {
        self.measure_again(parts, last)?;
        if self.searched().is_some_and(|at| !at.is_nan()) {
            self.go_on(parts)?;
        }
        loop {
            let enough = self.enough(tolerance);
            let row = parts.highest();
            let (next, bound, split) = parts.state(row);
            if !(bound > enough) {
                return Ok(bound);
            }
            let ends = [row, next];
            let is_closest = ends.iter().all(|&row| parts.fit(row) >= Fit::Closest);
            let Some(split) = split.filter(|_| is_closest) else {
                // A walk is not begun if no bound could follow.
                if self.is_spent_for(TURN + BOUND_COST) {
                    return Ok(bound);
                }
                self.spend_if_priced(TURN);
                for row in ends {
                    if split.is_none() {
                        self.load_corners(parts, row)?;
                    } else {
                        self.walk(parts, row)?;
                    }
                }
                if self.lacks(BOUND_COST) {
                    return Ok(bound);
                }
                self.renew(parts, row, enough);
                continue;
            };
            let is_open = |sample: &Sample| sample.fit == Fit::Closest && sample.depth > enough;
            if self.remembered.is_some() {
                self.spend_if_priced(TURN);
                if let Some(end) = ends.into_iter().find(|&row| is_open(&parts.sample(row))) {
                    if self.samples >= MOST_SAMPLES || self.is_spent() {
                        return Ok(bound);
                    }
                    let sample = self.measure(parts.sample(end), enough)?;
                    parts.set_sample(end, sample);
                    if self.lacks(BOUND_COST) {
                        return Ok(bound);
                    }
                    self.renew(parts, row, enough);
                    continue;
                }
            }
            let Some(free) = self.room(parts, enough) else { return Ok(bound) };
            let (from, to) = (parts.sample(row), parts.sample(next));
            let is_nearer = split - from.along < to.along - split;
            let ends = if is_nearer { [&from, &to] } else { [&to, &from] };
            let mut middle = self.between(split, ends, enough)?;
            if middle.depth > enough {
                middle = self.measure(middle, enough)?;
            }
            let enough = self.enough(tolerance);
            if self.lacks(2 * BOUND_COST) {
                // A later turn, of this tick or another, bounds them.
                parts.set(row, Part::remembered(from, free, bound));
                parts.push(Part::remembered(middle, next, bound));
                continue;
            }
            let before = Bound::between(&from, &middle, enough, &self.touches);
            let after = Bound::between(&middle, &to, enough, &self.touches);
            self.spend((before.distances + after.distances) * DISTANCE_COST);
            parts.set(row, Part::new(from, free, &before, bound));
            parts.push(Part::new(middle, next, &after, bound));
        }
    }

    /// A part whose bound is at most this is not searched.
    fn enough(&self, tolerance: f32) -> f32 {
        let least = self.remembered.as_ref().map_or(0.0, |known| known.between[0]);
        larger(least, self.deepest) + tolerance
    }

    /// Bounds a remembered part again.
    fn renew(&mut self, parts: &mut Parts, row: usize, enough: f32) {
        let distances = parts.renew(row, enough, &self.touches);
        self.spend(distances * DISTANCE_COST);
    }

    /// Counts work outside of tests as node tests.
    fn spend(&mut self, node_tests: u32) {
        let rest = self.options.budget;
        let spent = rest.tests().min(node_tests);
        self.options.budget = rest.less(spent);
        self.answer.node_tests = self.answer.node_tests.wrapping_add(spent);
    }

    /// Counts a tick's work besides its tests.
    fn spend_if_priced(&mut self, node_tests: u32) {
        if self.is_priced {
            self.spend(node_tests);
        }
    }

    /// Whether a tick's budget does not cover the next work.
    fn lacks(&self, node_tests: u32) -> bool {
        self.options.budget.tests() < node_tests && self.is_priced
    }

    /// Whether the budget is spent, or that of a tick does not cover the next work.
    fn is_spent_for(&self, node_tests: u32) -> bool {
        let left = self.options.budget.tests();
        left < node_tests && (left == 0 || self.is_priced)
    }

    const fn is_spent(&self) -> bool {
        self.options.budget.tests() == 0
    }

    /// The row for another part, if one may be divided.
    fn room(&self, parts: &mut Parts, enough: f32) -> Option<usize> {
        if self.samples >= MOST_SAMPLES || self.is_spent_for(2 * SAMPLE_COST) {
            return None;
        }
        if parts.free().is_none() {
            parts.join([self.deepest_at, self.searched().unwrap_or(f32::NAN)], enough);
        }
        parts.free()
    }

    /// The sample of the axis' point at a parameter, at most `depth` deep, with the triangle of another sample.
    fn at(&self, parameter: f32, depth: f32, near: &Sample) -> Sample {
        let (along, on_axis) =
            (parameter * self.tool.axis_length(), self.tool.axis_point(parameter));
        Sample { parameter, along, on_axis, depth, ..*near }
    }

    /// The sample of the axis' point at a parameter, with the corners closest to it.
    fn sample(
        &self,
        parameter: f32,
        depth: f32,
        triangle: Option<TriangleRow>,
        corners: [u32; 3],
    ) -> Result<Sample, QueryError> {
        let on_axis = self.tool.axis_point(parameter);
        let along = parameter * self.tool.axis_length();
        let corners = self.corners(corners)?;
        Ok(Sample { parameter, along, on_axis, depth, triangle, corners, fit: Fit::Closest })
    }

    /// A function of its own: it has four callers, and tightly coupled memory is small.
    #[inline(never)]
    fn corners(&self, rows: [u32; 3]) -> Result<[Vec3; 3], QueryError> {
        positions(self.vertices, rows)
    }

    /// The answer, if no point of the axis is deeper than `bound`.
    fn finish(&self, bound: f32) -> Result<Proximity, QueryError> {
        let Self { mut answer, closest, is_inside, .. } = *self;
        let is_open = closest.side == Side::Undefined(NoSide::CutShort);
        if !(is_inside || is_open) {
            if self.deepest <= 0.0 {
                let on_axis = self.tool.axis_point(closest.axis_parameter);
                let outward = side::outward(self.tree, self.vertices, closest)?.unwrap_or_default();
                answer.direction = outward;
                answer.point_on_tool = on_axis - outward * self.tool.radius();
            }
            let crosses = closest.axis_distance <= 0.0 || self.deepest > answer.accuracy;
            let is_near = closest.axis_distance > closest.accuracy;
            answer.side = match (crosses, is_near) {
                (false, _) => Side::Undefined(NoSide::BelowAccuracy),
                (true, false) => Side::Crossing,
                // The axis does not meet the surface, and a point of it is inside.
                (true, true) => Side::Inside,
            };
        }
        let most = larger(self.deepest, bound);
        // If no point is inside, `answer` is still the closest pair, which may be farther than the accuracy.
        if self.deepest > 0.0 {
            answer.separation = -self.tool.radius() - self.deepest;
        }
        answer.lower = -self.tool.radius() - most;
        Ok(answer)
    }
}

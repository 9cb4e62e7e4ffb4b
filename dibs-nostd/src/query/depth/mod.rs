//! The depth of a capsule's axis that crosses the surface or is inside: the largest of any of its points.
//!
//! The depth along the axis, positive inside and negative outside, changes by at most the length moved, and is at most
//! the distance to any one triangle of the surface. That distance is convex along the axis, so the triangles closest to
//! two points bound the depth between them. The search divides the part of the axis with the highest bound (Piyavskii
//! and Shubert, with this second bound added) until no part can be deeper than the deepest point found by more than the
//! tolerance. The axis stays on one side between two places where it meets the surface, and parts outside are not searched.
//! Steps from the triangles of the two points beside it often find one that shows a point to be no deeper. Such a point is
//! not searched.
//!
//! The work is bounded: it takes as long as 1.5 node tests for each of the tree's nodes at most, or as 4,608 if that is more,
//! and then ends with the interval so far.
//!
//! A tracker keeps the bounds. Tool and surface change a depth by at most their motion, so the next tick looks only at
//! the parts whose bounds have come above the deepest point by more than the tolerance.
//!
//! One file, because the search and its steps share one state.

mod part;
mod start;
mod touches;
mod walk;

use glam::Vec3;

use super::memory::depth::{Point, Points};
use super::memory::leaves::Leaves;
use super::search::{Search, Ties, UNTIL, Waiting};
use super::side::{self, COORDINATES, NoSide, OnAxis, Side};
use super::{Options, Proximity};
use crate::tool::{AxisPoint, Tool};
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tree, TriangleRow, VertexTable};
use part::{Bound, Fit, Part, Parts, Sample, larger};
use touches::Touches;

/// A limit that no search reaches before its end.
const EXACT: f32 = f32::NEG_INFINITY;

/// The default tolerance, as a part of the axis' length.
const TOLERANCE: f32 = 1.0 / 512.0;

/// The least default tolerance, in units of the accuracy: about a hundredth of a millimetre on a heart.
const LEAST_TOLERANCE: f32 = 32.0;

/// Most points of the axis that are searched.
const LOOKS: u32 = 27;

/// Node tests that any depth may take, however small the tree.
const LEAST_WORK: u32 = 4_608;

/// Node tests that take as long as the work for a point of the axis besides its search. Without them a budget would not
/// bound a tracker's tick, which may look at many points and triangles without a search.
const LOOK_COST: u32 = 16;

/// Node tests that take as long as a point's distance to one triangle.
const DISTANCE_COST: u32 = 3;

/// The search for the deepest point of a tool's axis.
pub(super) struct Depth<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    stack: &'s mut [Waiting],
    vertices: &'s V,
    tool: &'s T,
    /// With the rest of the query's budget.
    options: Options,
    /// The closest pair, in which a crossing axis meets the surface.
    closest: &'s Proximity,
    /// The whole axis is inside.
    is_inside: bool,
    /// The places where the axis meets the surface.
    touches: Touches,
    /// The deepest point so far.
    answer: Proximity,
    deepest: f32,
    /// Its parameter; not a number if no point is inside.
    deepest_at: f32,
    /// Points searched.
    looks: u32,
    /// The leaves around the deepest point of the last tick.
    leaves: Option<&'s mut Leaves>,
    /// Roots of the shells that decide.
    roots: RootSet,
    /// The triangles that the axis may meet; then those that may be the closest to the point searched last.
    ties: &'s mut Ties,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'s, 't, I, V, T> {
    /// A search for a tool whose axis meets the surface in the pair `closest`, or is inside by that pair's side, below
    /// some roots.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        tree: &'s Tree<'t, I>,
        stack: &'s mut [Waiting],
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        closest: &'s Proximity,
        leaves: Option<&'s mut Leaves>,
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
            looks: 0,
            leaves,
            roots,
            ties,
        }
    }

    /// The answer with side, signed separation, and the deepest point's pair. `known` is the last tick's search, and
    /// then this one.
    pub fn run(&mut self, known: Option<&mut Points>) -> Result<Proximity, QueryError> {
        let least = LEAST_TOLERANCE * self.closest.accuracy;
        let default = larger(self.tool.axis_length() * TOLERANCE, least);
        let tolerance = self.options.depth_tolerance.unwrap_or(default);
        let reach = self.reach();
        if reach <= self.deepest + tolerance {
            if let Some(known) = known {
                known.forget();
            }
            return self.finish(reach);
        }
        self.find_touches()?;
        let mut parts = Parts::new();
        let last = match known.as_deref().and_then(|known| known.below(reach)) {
            Some((points, deepest)) => {
                self.resume(&mut parts, points);
                Some(deepest)
            }
            None => {
                self.begin(&mut parts, reach, tolerance)?;
                None
            }
        };
        let bound = self.divide(&mut parts, tolerance, last)?;
        if let Some(known) = known {
            while parts.count() > Points::MOST && parts.join(self.deepest_at, f32::INFINITY) {}
            let point = |Part { from, bound, .. }: Part| {
                let Sample { parameter, depth, triangle, .. } = from;
                Some(Point { parameter, depth, bound, triangle: triangle? })
            };
            known.keep(parts.in_order().map(point), self.deepest_at);
        }
        self.finish(bound)
    }

    /// The most that any point of the axis can be deep, by its distance from the closest point.
    fn reach(&self) -> f32 {
        let (length, closest) = (self.tool.axis_length(), self.closest);
        let along = closest.axis_parameter * length;
        larger(along, length - along) + closest.axis_distance + closest.accuracy
    }

    /// Looks at the last tick's deepest point, then divides the part with the highest bound until none is above the
    /// deepest point by more than the tolerance. Returns the highest bound.
    fn divide(
        &mut self,
        parts: &mut Parts,
        tolerance: f32,
        last: Option<f32>,
    ) -> Result<f32, QueryError> {
        if let Some(row) = last.and_then(|at| parts.row_of(at)) {
            self.look_again(parts, row)?;
        }
        loop {
            let enough = self.deepest + tolerance;
            let row = parts.highest();
            let (next, bound, split) = parts.state(row);
            if !(bound > enough) {
                return Ok(bound);
            }
            let ends = [row, next];
            let is_closest = ends.iter().all(|&row| parts.sample(row).fit == Fit::Closest);
            let Some(split) = split.filter(|_| is_closest) else {
                if self.is_spent() {
                    return Ok(bound);
                }
                for row in ends {
                    if split.is_none() {
                        self.place(parts, row)?;
                    } else {
                        self.walk(parts, row)?;
                    }
                }
                self.renew(parts, row, enough);
                continue;
            };
            let Some(place) = self.room(parts, enough) else { return Ok(bound) };
            let (from, to) = (parts.sample(row), parts.sample(next));
            let is_nearer = split - from.along < to.along - split;
            let ends = if is_nearer { [&from, &to] } else { [&to, &from] };
            let mut middle = self.between(split, ends, enough)?;
            if middle.depth > enough {
                middle = self.look(middle, enough)?;
            }
            let enough = self.deepest + tolerance;
            let before = self.bound(&from, &middle, enough);
            let after = self.bound(&middle, &to, enough);
            parts.set(row, Part::new(from, place, &before, bound));
            parts.push(Part::new(middle, next, &after, bound));
        }
    }

    /// The bound between two samples.
    fn bound(&mut self, from: &Sample, to: &Sample, enough: f32) -> Bound {
        let bound = Bound::between(from, to, enough, &self.touches);
        self.spend(bound.distances * DISTANCE_COST);
        bound
    }

    /// Bounds a remembered part anew.
    fn renew(&mut self, parts: &mut Parts, row: usize, enough: f32) {
        let distances = parts.renew(row, enough, &self.touches);
        self.spend(distances * DISTANCE_COST);
    }

    /// Counts work that is no test as so many node tests.
    fn spend(&mut self, node_tests: u32) {
        let rest = self.options.budget;
        let spent = rest.tests().min(node_tests);
        self.options.budget = rest.less(spent);
        self.answer.node_tests = self.answer.node_tests.saturating_add(spent);
    }

    const fn is_spent(&self) -> bool {
        self.options.budget.tests() == 0
    }

    /// Searches the point of a sample to the end; the leaves around it are remembered.
    fn look_again(&mut self, parts: &mut Parts, row: usize) -> Result<(), QueryError> {
        let sample = parts.sample(row);
        if let Some(leaves) = &mut self.leaves {
            leaves.move_to(sample.parameter, self.tool.axis_length());
        }
        let sample = self.look(sample, EXACT)?;
        parts.set_sample(row, sample);
        Ok(())
    }

    /// The row of another part, if one may be divided.
    fn room(&self, parts: &mut Parts, enough: f32) -> Option<usize> {
        if self.looks >= LOOKS || self.is_spent() {
            return None;
        }
        if parts.free().is_none() {
            parts.join(self.deepest_at, enough);
        }
        parts.free()
    }

    /// Searches a point of the axis. Out of budget, returns the sample as it is. Only a tracker searches a point to the
    /// end that is no deeper than `enough`.
    fn look(&mut self, sample: Sample, enough: f32) -> Result<Sample, QueryError> {
        self.looks += 1;
        self.spend(LOOK_COST);
        let Sample { parameter, on_axis, .. } = sample;
        // The root's test is one of them.
        if self.is_spent() {
            return Ok(sample);
        }
        let options = self.options.budget(self.options.budget.less(1));
        let (point, first) = (AxisPoint(on_axis), sample.triangle);
        let search = Search::start(
            self.roots,
            self.tree,
            self.stack,
            self.vertices,
            &point,
            &options,
            first,
            Some(&mut *self.ties),
        )?;
        // A bound that is just low enough would not be so at the next tick.
        let enough = if self.leaves.is_some() { EXACT } else { enough };
        let length = self.tool.axis_length();
        let leaves = self.leaves.as_deref_mut();
        let mut found = match leaves.map(|leaves| (leaves.way_to(parameter, length), leaves)) {
            Some((way, leaves)) if search.is_among(leaves, way) => search.among(leaves, way)?,
            Some((way, leaves)) if way <= 0.0 => search.gather(leaves)?,
            _ => search.run::<UNTIL>(enough)?,
        };
        let (tree, vertices, roots) = (self.tree, self.vertices, self.roots);
        let is_many = self.ties.are_lost() && !found.is_cut_short();
        let many = is_many
            .then(|| {
                side::of_many(roots, tree, self.stack, vertices, &mut found, on_axis, &options)
            })
            .transpose()?;
        self.options = self.options.after(found.tests());
        self.answer.add_tests(found.tests());
        let distance = found.axis_distance;
        let at = if found.is_cut_short() {
            None
        } else {
            let (at, left) = (OnAxis::new(&point, 0.0), self.options.budget.tests());
            Some(side::of_point(tree, vertices, &found, &at, self.ties, many, left)?)
        };
        self.spend(at.map_or(0, |at| at.work));
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
                distance
            }
            _ => distance,
        };
        let accuracy = found.accuracy + COORDINATES * on_axis.abs().max_element();
        if accuracy > answer.accuracy {
            answer.accuracy = accuracy;
        }
        // Without a triangle of its own, its corners are a pin.
        let triangle = found.triangle.or(sample.triangle);
        self.sample(parameter, depth, triangle, found.corners)
    }

    /// The sample of the axis' point at a parameter, which is no deeper than `depth`, with the triangle of another one.
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

    fn corners(&self, [a, b, c]: [u32; 3]) -> Result<[Vec3; 3], QueryError> {
        let position = |row| self.vertices.position(row).ok_or(QueryError::Corrupt { row });
        Ok([position(a)?, position(b)?, position(c)?])
    }

    /// The answer, where no point of the axis is deeper than `bound`.
    fn finish(&self, bound: f32) -> Result<Proximity, QueryError> {
        let Self { mut answer, closest, is_inside, .. } = *self;
        if !is_inside {
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
                // It does not meet the surface, and a point of it is inside.
                (true, true) => Side::Inside,
            };
        }
        let most = if bound > self.deepest { bound } else { self.deepest };
        // If no point is inside, it is still that of the closest pair, which may be farther than the accuracy.
        if self.deepest > 0.0 {
            answer.separation = -self.tool.radius() - self.deepest;
        }
        answer.lower = -self.tool.radius() - most;
        Ok(answer)
    }
}

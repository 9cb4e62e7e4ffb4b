//! The depth of a capsule's axis below the surface that it crosses.
//!
//! The depth along the axis, positive inside and negative outside, changes by at most the length moved, and is at most
//! the distance to any one triangle of the surface. That distance is convex along the axis, so the triangles closest to
//! two points bound the depth between them. The search divides the part of the axis with the highest bound (Piyavskii
//! and Shubert, with this second bound added) until no part can be deeper than the deepest point found by more than the
//! tolerance.

use glam::Vec3;

use super::search::{Search, Waiting};
use super::side::{self, NoSide, Side};
use super::{Budget, Options, Proximity};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPoint, Tool};
use crate::unavailable::QueryError;
use crate::{Index, Tree, TriangleRow, VertexTable};

/// Most points of the axis that are searched, including its ends and the point where it meets the surface.
const POINTS: usize = 28;

/// The default tolerance, as a part of the axis' length.
const TOLERANCE: f32 = 1.0 / 512.0;

/// Least distance of a split from an end of its part, as a share of the part's length.
const NEAREST_SPLIT: f32 = 0.125;

/// Most steps towards the point at which two triangles are equally far.
const ROUNDS: u32 = 3;

/// A point of the axis and the triangle found closest to it; where the budget ended, one pin as all three corners.
#[derive(Clone, Copy)]
struct Sample {
    /// Length along the axis from its start.
    along: f32,
    on_axis: Vec3,
    /// Upper bound on its depth.
    depth: f32,
    triangle: Option<TriangleRow>,
    corners: [Vec3; 3],
}

impl Sample {
    /// Square of the distance from a point to the triangle.
    fn square(&self, point: Vec3) -> f32 {
        let pair = AxisPoint(point).closest_on_triangle(&self.corners, f32::INFINITY);
        pair.map_or(f32::INFINITY, |pair| pair.distance_squared)
    }
}

/// A sample, and the part of the axis from there to another one.
#[derive(Clone, Copy)]
struct Part {
    from: Sample,
    /// Row of the part that the other one begins.
    next: usize,
    /// No point of the part is deeper.
    bound: f32,
    /// Length along the axis at which it is divided next.
    split: f32,
}

impl Part {
    /// The empty part at the axis' end.
    fn none(from: Sample) -> Self {
        Self { from, next: 0, bound: 0.0, split: 0.0 }
    }

    /// The part up to `to`. A bound that is no higher than `enough` is not lowered further.
    fn new(from: Sample, to: &Sample, next: usize, enough: f32) -> Self {
        let length = to.along - from.along;
        // Points nearer to an outside sample than its distance are outside too.
        let first = from.along + above_zero(-from.depth);
        let last = to.along - above_zero(-to.depth);
        if !(first < last) {
            return Self {
                from,
                next,
                bound: above_zero(larger(from.depth, to.depth)),
                split: first,
            };
        }
        let slope = (from.depth + to.depth + length) * 0.5;
        let middle = (first + last) * 0.5;
        if slope <= enough {
            return Self { from, next, bound: slope, split: middle };
        }
        let direction = (to.on_axis - from.on_axis) / length;
        let squares = |along: f32| {
            let point = from.on_axis + direction * (along - from.along);
            [from.square(point), to.square(point)]
        };
        let (at_first, at_last) = (squares(first), squares(last));
        // The first triangle's lead over the second: linear along the axis where both are points.
        let lead = |[one, other]: [f32; 2]| other - one;
        let (mut low, mut high) = ((first, lead(at_first)), (last, lead(at_last)));
        let (mut least, mut peak) = (f32::INFINITY, middle);
        for _ in 0..ROUNDS {
            let equal = low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1));
            let is_between = equal > low.0 && equal < high.0;
            let along = if is_between { equal } else { (low.0 + high.0) * 0.5 };
            let here = squares(along);
            let highest = larger(convex(at_first, here), convex(here, at_last));
            if highest < least {
                (least, peak) = (highest, along);
            }
            if least <= enough * enough {
                break;
            }
            let side = (along, lead(here));
            if side.1 > 0.0 {
                low = side;
            } else {
                high = side;
            }
        }
        let convex = sqrt(least);
        let margin = (last - first) * NEAREST_SPLIT;
        let split = if peak < first + margin {
            first + margin
        } else if peak > last - margin {
            last - margin
        } else {
            peak
        };
        Self { from, next, bound: if convex < slope { convex } else { slope }, split }
    }
}

/// Upper bound, between two places, on the smaller of two convex functions, from their values there.
fn convex([one, other]: [f32; 2], [one_next, other_next]: [f32; 2]) -> f32 {
    let (most, other_most) = (larger(one, one_next), larger(other, other_next));
    if most < other_most { most } else { other_most }
}

fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

fn above_zero(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// The search for the deepest point of a tool's axis.
pub(super) struct Depth<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    stack: &'s mut [Waiting],
    vertices: &'s V,
    tool: &'s T,
    /// With the rest of the query's budget.
    options: Options,
    /// The deepest point so far.
    answer: Proximity,
    deepest: f32,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'s, 't, I, V, T> {
    /// A search for a tool whose axis meets the surface in the pair `meeting`.
    pub fn new(
        tree: &'s Tree<'t, I>,
        stack: &'s mut [Waiting],
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        meeting: &Proximity,
    ) -> Self {
        let mut options = *options;
        options.stretch = options.stretch.or_else(|| vertices.stretch());
        let Budget { node_tests, triangle_tests } = &mut options.budget;
        *node_tests = node_tests.saturating_sub(meeting.node_tests);
        *triangle_tests = triangle_tests.saturating_sub(meeting.triangle_tests);
        Self { tree, stack, vertices, tool, options, answer: *meeting, deepest: 0.0 }
    }

    /// The answer with side, signed separation, and the deepest point's pair.
    pub fn run(mut self) -> Result<Proximity, QueryError> {
        let meeting = self.answer;
        let length = self.tool.axis_length();
        let tolerance = self.options.depth_tolerance.unwrap_or(length * TOLERANCE);
        let depth = meeting.axis_distance + meeting.accuracy;
        let crossing =
            self.sample(meeting.axis_parameter * length, meeting.axis_parameter, depth, &meeting)?;
        let start = self.look(0.0, length, &crossing)?;
        let end = self.look(length, length, &crossing)?;
        let mut enough = self.deepest + tolerance;
        let mut parts = [Part::none(end); POINTS];
        let [first, second, ..] = &mut parts;
        *first = Part::new(start, &crossing, 1, enough);
        *second = Part::new(crossing, &end, 2, enough);
        let mut count = 3;
        let bound = loop {
            let [mut part, ..] = parts;
            let mut highest = 0;
            for (row, other) in parts.iter().enumerate().take(count) {
                if other.bound > part.bound {
                    (highest, part) = (row, *other);
                }
            }
            let Part { from, next, bound, split } = part;
            let is_spent = self.options.budget.node_tests == 0;
            let to = parts.get(next).map(|part| part.from);
            let Some(to) = to.filter(|_| bound > enough && !is_spent) else { break bound };
            let Some(free) = parts.get_mut(count) else { break bound };
            let near = if split - from.along < to.along - split { &from } else { &to };
            let middle = self.look(split, length, near)?;
            enough = self.deepest + tolerance;
            *free = Part::new(middle, &to, next, enough);
            if let Some(divided) = parts.get_mut(highest) {
                *divided = Part::new(from, &middle, count, enough);
            }
            count += 1;
        };
        self.finish(&meeting, bound)
    }

    /// Samples one point of the axis, near another sample. Out of budget, derives its bound from that sample.
    fn look(&mut self, along: f32, length: f32, near: &Sample) -> Result<Sample, QueryError> {
        let parameter = along / length;
        let on_axis = self.tool.axis_point(parameter);
        let Budget { node_tests, triangle_tests } = self.options.budget;
        // The root's test is one of them.
        let Some(node_tests) = node_tests.checked_sub(1) else {
            return Ok(Sample {
                along,
                on_axis,
                depth: near.depth + (along - near.along).abs(),
                ..*near
            });
        };
        let options = self.options.budget(Budget { node_tests, triangle_tests });
        let (point, first) = (AxisPoint(on_axis), near.triangle);
        let search = Search::start(self.tree, self.stack, self.vertices, &point, &options, first)?;
        let found = search.run::<false>(f32::INFINITY)?;
        self.options.budget = Budget {
            node_tests: node_tests.saturating_sub(found.node_tests.saturating_sub(1)),
            triangle_tests: triangle_tests.saturating_sub(found.triangle_tests),
        };
        let answer = &mut self.answer;
        answer.node_tests = answer.node_tests.saturating_add(found.node_tests);
        answer.triangle_tests = answer.triangle_tests.saturating_add(found.triangle_tests);
        let distance = found.axis_distance;
        let at = if found.is_cut_short() {
            None
        } else {
            Some(side::of_point(self.tree, self.vertices, &found, on_axis)?)
        };
        let depth = match at {
            Some(at) if at.side == Side::Outside => -distance,
            Some(at) if at.side == Side::Inside && distance > self.deepest => {
                self.deepest = distance;
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
        if found.accuracy > answer.accuracy {
            answer.accuracy = found.accuracy;
        }
        self.sample(along, parameter, depth, &found)
    }

    /// The sample of the axis' point at a parameter, from its closest pair.
    fn sample(
        &self,
        along: f32,
        parameter: f32,
        depth: f32,
        found: &Proximity,
    ) -> Result<Sample, QueryError> {
        let on_axis = self.tool.axis_point(parameter);
        let position = |row| self.vertices.position(row).ok_or(QueryError::Corrupt { row });
        let [a, b, c] = found.corners;
        let corners = [position(a)?, position(b)?, position(c)?];
        Ok(Sample { along, on_axis, depth, triangle: found.triangle, corners })
    }

    /// The answer, where no point of the axis is deeper than `bound`.
    fn finish(self, meeting: &Proximity, bound: f32) -> Result<Proximity, QueryError> {
        let mut answer = self.answer;
        if self.deepest <= 0.0 {
            let on_axis = self.tool.axis_point(meeting.axis_parameter);
            let at = side::of_point(self.tree, self.vertices, meeting, on_axis)?;
            answer.direction = at.outward;
            answer.point_on_tool = on_axis - at.outward * self.tool.radius();
        }
        let crosses = meeting.axis_distance <= 0.0 || self.deepest > answer.accuracy;
        answer.side = if crosses { Side::Crossing } else { Side::Undefined(NoSide::BelowAccuracy) };
        let most = if bound > self.deepest { bound } else { self.deepest };
        answer.separation = -self.tool.radius() - self.deepest;
        answer.lower = -self.tool.radius() - most;
        Ok(answer)
    }
}

//! How deep a capsule's axis reaches below the surface that it crosses.
//!
//! The depth along the axis, positive inside and negative outside, changes by at most the way along it, and is at
//! most the distance to any one point of the surface. So what is known at two points bounds it between them, and the
//! part of the axis with the highest bound is divided next (Piyavskii and Shubert, with the second bound besides)
//! until no part can be deeper than the deepest point found by more than the tolerance.

use glam::Vec3;

use super::search::{Search, Waiting};
use super::side::{self, NoSide, Side};
use super::{Budget, Options, Proximity};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPoint, Tool};
use crate::unavailable::QueryError;
use crate::{Index, Tree, VertexTable};

/// Most points of the axis that are looked at besides its ends.
const MAX_POINTS: usize = 24;

/// The tolerance, unless it is chosen: this part of the axis' length.
const TOLERANCE: f32 = 1.0 / 512.0;

/// How near to an end a part is divided, as a part of its length.
const NEAREST_SPLIT: f32 = 0.125;

/// A point of the axis, and what was found there.
#[derive(Clone, Copy)]
struct Sample {
    /// Where it is on the axis, as a length from its start.
    along: f32,
    on_axis: Vec3,
    on_surface: Vec3,
    /// It is at most as deep as this.
    depth: f32,
    triangle: Option<u32>,
}

/// A part of the axis between two samples.
#[derive(Clone, Copy)]
struct Part {
    from: Sample,
    to: Sample,
    /// No point of it is deeper.
    bound: f32,
    /// Where it is divided next.
    split: f32,
}

impl Part {
    fn new(from: Sample, to: Sample) -> Self {
        let length = to.along - from.along;
        // What is surely outside is left out.
        let first = from.along + above_zero(-from.depth);
        let last = to.along - above_zero(-to.depth);
        if !(first < last) {
            let bound = above_zero(if from.depth > to.depth { from.depth } else { to.depth });
            return Self { from, to, bound, split: first };
        }
        let direction = (to.on_axis - from.on_axis) / length;
        let to_nearer = |along: f32| {
            let point = from.on_axis + direction * (along - from.along);
            let one = (point - from.on_surface).length_squared();
            let other = (point - to.on_surface).length_squared();
            if one < other { one } else { other }
        };
        // Where both surface points are equally far: the difference of the squares is linear.
        let ahead = (from.on_axis - to.on_surface).length_squared()
            - (from.on_axis - from.on_surface).length_squared();
        let equal = from.along + ahead / (2.0 * direction.dot(to.on_surface - from.on_surface));
        let is_between = equal > first && equal < last;
        let peak = if is_between { equal } else { (first + last) * 0.5 };
        // Of the lesser of two convex functions, the largest is at an end or where they change places.
        let mut highest = to_nearer(first);
        for along in [peak, last] {
            let square = to_nearer(along);
            if square > highest {
                highest = square;
            }
        }
        let convex = sqrt(highest);
        let slope = (from.depth + to.depth + length) * 0.5;
        let margin = (last - first) * NEAREST_SPLIT;
        let split = if peak < first + margin {
            first + margin
        } else if peak > last - margin {
            last - margin
        } else {
            peak
        };
        Self { from, to, bound: if convex < slope { convex } else { slope }, split }
    }
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
    /// Its budget is what is left of it.
    options: Options,
    /// What is known: the deepest point so far.
    answer: Proximity,
    deepest: f32,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'s, 't, I, V, T> {
    /// A search for a tool whose axis meets the surface as `meeting` says.
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
        let crossing = Sample {
            along: meeting.axis_parameter * length,
            on_axis: self.tool.axis_point(meeting.axis_parameter),
            on_surface: meeting.point_on_surface,
            depth: meeting.axis_distance + meeting.accuracy,
            triangle: meeting.triangle,
        };
        let start = self.look(0.0, length, &crossing)?;
        let end = self.look(length, length, &crossing)?;
        let mut parts = [Part::new(start, crossing); MAX_POINTS];
        let [_, second, ..] = &mut parts;
        *second = Part::new(crossing, end);
        let mut count = 2;
        let bound = loop {
            let [mut part, ..] = parts;
            let mut highest = 0;
            for (row, other) in parts.iter().enumerate().take(count) {
                if other.bound > part.bound {
                    (highest, part) = (row, *other);
                }
            }
            let Part { from, to, bound, split } = part;
            let Some(free) = parts.get_mut(count) else { break bound };
            if !(bound > self.deepest + tolerance) || self.options.budget.node_tests == 0 {
                break bound;
            }
            let near = if split - from.along < to.along - split { &from } else { &to };
            let middle = self.look(split, length, near)?;
            *free = Part::new(middle, to);
            count += 1;
            if let Some(divided) = parts.get_mut(highest) {
                *divided = Part::new(from, middle);
            }
        };
        self.finish(&meeting, bound)
    }

    /// Looks at one point of the axis, near a sample; out of budget, says what that sample says of it.
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
        let found = search.run()?;
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
        let on_surface = found.point_on_surface;
        Ok(Sample { along, on_axis, on_surface, depth, triangle: found.triangle })
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

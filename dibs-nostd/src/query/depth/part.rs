//! Parts of the axis, and the bounds on the depth in them.

use glam::Vec3;

use super::touches::{Free, Touches};
use crate::TriangleRow;
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPoint, Tool};

/// Most points of the axis in a list, including its ends and the point where it meets the surface.
pub(super) const POINTS: usize = 28;

/// Least distance of a split from an end of its part, as a fraction of the part's length.
const NEAREST_SPLIT: f32 = 0.125;

/// Most steps towards the point at equal distance from two triangles.
const ROUNDS: u32 = 2;

/// Most distances to triangles computed for a bound.
pub(super) const MOST_DISTANCES: u32 = 2 * (2 + 2 + ROUNDS);

/// A point of the axis and the triangle found closest to it; if the budget ended, one pin as all three corners.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Its parameter: 0 at the axis' start, 1 at its end.
    pub parameter: f32,
    /// Length along the axis from its start.
    pub along: f32,
    pub on_axis: Vec3,
    /// Upper bound on its depth.
    pub depth: f32,
    pub triangle: Option<TriangleRow>,
    pub corners: [Vec3; 3],
    pub fit: Fit,
}

/// How the sample's triangle was found.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub(super) enum Fit {
    /// At an earlier tick; its corners have not been read.
    Remembered,
    /// At an earlier tick.
    Near,
    /// As the closest found at this tick.
    Closest,
    /// As the closest, by a search completed at this tick.
    Searched,
}

impl Sample {
    pub const NONE: Self = Self {
        parameter: 0.0,
        along: 0.0,
        on_axis: Vec3::ZERO,
        depth: 0.0,
        triangle: None,
        corners: [Vec3::ZERO; 3],
        fit: Fit::Remembered,
    };

    /// Square of the distance from a point to the triangle.
    pub fn square(&self, point: Vec3) -> f32 {
        square(point, &self.corners)
    }

    /// A bound on the depth from here to the end of a free length that is outside, if it is at most `enough`. It takes up
    /// to two distances.
    fn passes(&self, free: &Free, point: impl Fn(f32) -> Vec3, enough: f32) -> Option<f32> {
        if free.from == self.along {
            return Some(0.0);
        }
        // The distance to a triangle is convex.
        let square = larger(self.square(point(free.from)), self.square(self.on_axis));
        (square <= enough * enough).then(|| sqrt(square))
    }
}

/// A sample, and the part of the axis from it to the next sample.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub from: Sample,
    /// Row of the part that starts at the next sample; 0 at the axis' end.
    pub next: usize,
    /// Upper bound on the depth in the part.
    pub bound: f32,
    /// Length along the axis of its next division; `None` if the bound is from an earlier tick.
    pub split: Option<f32>,
}

/// A bound on the depth between two samples.
#[derive(Clone, Copy)]
pub(super) struct Bound {
    /// Upper bound on the first sample's depth.
    pub depth: f32,
    /// Upper bound on the depth between the samples.
    pub bound: f32,
    /// Length along the axis at which to divide.
    pub split: f32,
    /// Number of distances to triangles computed.
    pub distances: u32,
}

impl Part {
    const NONE: Self = Self::remembered(Sample::NONE, 0, 0.0);

    /// A remembered part.
    pub const fn remembered(from: Sample, next: usize, bound: f32) -> Self {
        Self { from, next, bound, split: None }
    }

    /// The part with its own bound, limited by the bound `most` of a part that contains it.
    pub fn new(mut from: Sample, next: usize, own: &Bound, most: f32) -> Self {
        from.depth = own.depth;
        Self { from, next, bound: smaller(most, own.bound), split: Some(own.split) }
    }
}

impl Bound {
    /// The bound between two samples. Once it is at most `enough`, it is not lowered further.
    pub fn between(from: &Sample, to: &Sample, enough: f32, touches: &Touches) -> Self {
        let length = to.along - from.along;
        // A depth changes by at most the length moved.
        let depth = smaller(to.depth + length, from.depth);
        let to_depth = smaller(depth + length, to.depth);
        let part = |bound, split, distances| Self { depth, bound, split, distances };
        let span = to.on_axis - from.on_axis;
        let point = |along: f32| from.on_axis + span * ((along - from.along) / length);
        // Points nearer to an outside sample than its distance to the surface are outside too.
        let (mut first, mut last) =
            (from.along + above_zero(-depth), to.along - above_zero(-to_depth));
        let (mut beside, mut distances) = (0.0, 0);
        let (ahead, behind) = (touches.ahead(from.along), touches.behind(to.along));
        if ahead.is_outside && ahead.from < to.along {
            distances += 2;
            if let Some(most) = from.passes(&ahead, point, enough) {
                (first, beside) = (larger(ahead.to, first), most);
            }
        }
        if behind.is_outside && behind.from > from.along {
            distances += 2;
            if let Some(most) = to.passes(&behind, point, enough) {
                (last, beside) = (smaller(behind.to, last), larger(most, beside));
            }
        }
        if !(first < last) {
            let middle = (from.along + to.along) * 0.5;
            return part(beside, middle, distances);
        }
        let slope = (depth + to_depth + length) * 0.5;
        let middle = (first + last) * 0.5;
        if slope <= enough {
            return part(larger(slope, beside), middle, distances);
        }
        let squares = |along: f32| [from.square(point(along)), to.square(point(along))];
        let (at_first, at_last) = (squares(first), squares(last));
        // The difference of the second and first triangle's distances: linear along the axis if both triangles are
        // points.
        let lead = |[one, other]: [f32; 2]| other - one;
        let (mut low, mut high) = ((first, lead(at_first)), (last, lead(at_last)));
        let (mut least, mut peak) = (f32::INFINITY, middle);
        distances += 4;
        for _ in 0..ROUNDS {
            let equal = low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1));
            let is_between = equal > low.0 && equal < high.0;
            let along = if is_between { equal } else { (low.0 + high.0) * 0.5 };
            let here = squares(along);
            distances += 2;
            let highest = larger(convex(here, at_last), convex(at_first, here));
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
        part(larger(smaller(slope, convex), beside), split, distances)
    }
}

/// The parts of the axis in a list from its start, in row 0, to its end.
pub(super) struct Parts {
    /// No vector: parts refer to each other by row.
    rows: [Part; POINTS],
    /// Rows from here on are unused.
    end: usize,
    /// Row of a part that was joined to the one before it.
    free: Option<usize>,
    count: usize,
}

impl Parts {
    pub fn new() -> Self {
        Self { rows: [Part::NONE; POINTS], end: 0, free: None, count: 0 }
    }

    /// Number of parts, the empty one at the end included.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The row of the next part to be pushed, if there is room.
    pub fn free(&self) -> Option<usize> {
        self.free.or((self.end < POINTS).then_some(self.end))
    }

    pub fn push(&mut self, part: Part) {
        let Some(row) = self.free() else { return };
        if self.free.take().is_none() {
            self.end += 1;
        }
        self.count += 1;
        self.set(row, part);
    }

    /// Makes the last row the empty part at the axis' end.
    pub fn end(&mut self) {
        if let Some(last) = self.end.checked_sub(1).and_then(|last| self.rows.get_mut(last)) {
            (last.next, last.bound) = (0, 0.0);
        }
    }

    /// Joins the two neighbouring parts with the least total length, of those at most `enough` deep, but not at a
    /// parameter in `kept`. Returns whether there were any.
    pub fn join(&mut self, kept: [f32; 2], enough: f32) -> bool {
        let (mut least, mut joined) = (f32::INFINITY, None);
        let mut row = 0;
        for _ in 0..self.count {
            let left = self.part(row);
            let right = self.part(left.next);
            if left.next == 0 || right.next == 0 {
                break;
            }
            let length = self.sample(right.next).along - left.from.along;
            let bound = larger(right.bound, left.bound);
            if length < least && bound <= enough && !kept.contains(&right.from.parameter) {
                (least, joined) = (length, Some((row, Part { next: right.next, bound, ..left })));
            }
            row = left.next;
        }
        let Some((row, part)) = joined else { return false };
        let free = self.part(row).next;
        self.set(free, Part { bound: f32::NEG_INFINITY, ..Part::NONE });
        self.set(row, part);
        self.free = Some(free);
        self.count -= 1;
        true
    }

    fn part(&self, row: usize) -> Part {
        self.rows.get(row).copied().unwrap_or(Part::NONE)
    }

    pub fn set(&mut self, row: usize, part: Part) {
        if let Some(slot) = self.rows.get_mut(row) {
            *slot = part;
        }
    }

    /// The row of the part with the highest bound.
    pub fn highest(&self) -> usize {
        let (mut highest, mut bound) = (0, f32::NEG_INFINITY);
        for (row, part) in self.rows.iter().enumerate().take(self.end) {
            if part.bound > bound {
                (highest, bound) = (row, part.bound);
            }
        }
        highest
    }

    /// The row of the next part, this part's bound, and the length along the axis of its next division.
    pub fn state(&self, row: usize) -> (usize, f32, Option<f32>) {
        self.rows.get(row).map_or((0, 0.0, None), |part| (part.next, part.bound, part.split))
    }

    /// The row of the sample with a parameter.
    pub fn row_of(&self, parameter: f32) -> Option<usize> {
        self.rows.iter().take(self.end).position(|part| part.from.parameter == parameter)
    }

    /// How the triangle at a part's start was found.
    pub fn fit(&self, row: usize) -> Fit {
        self.rows.get(row).map_or(Fit::Remembered, |part| part.from.fit)
    }

    /// The sample at a part's start.
    pub fn sample(&self, row: usize) -> Sample {
        self.part(row).from
    }

    pub fn set_sample(&mut self, row: usize, sample: Sample) {
        if let Some(part) = self.rows.get_mut(row) {
            part.from = sample;
        }
    }

    /// Bounds a remembered part again. Returns the number of distances to triangles computed.
    pub fn renew(&mut self, row: usize, enough: f32, touches: &Touches) -> u32 {
        let Some((from, next)) = self.rows.get(row).map(|part| (&part.from, part.next)) else {
            return 0;
        };
        let Some(to) = self.rows.get(next).map(|part| &part.from) else { return 0 };
        let own = Bound::between(from, to, enough, touches);
        if let Some(part) = self.rows.get_mut(row) {
            part.from.depth = own.depth;
            part.bound = smaller(part.bound, own.bound);
            part.split = Some(own.split);
        }
        own.distances
    }

    /// The parts from the axis' start to its end.
    pub fn in_order(&self) -> impl Iterator<Item = Part> {
        let mut row = 0;
        (0..self.count).map(move |_| {
            let part = self.part(row);
            row = part.next;
            part
        })
    }
}

pub(super) fn square(point: Vec3, corners: &[Vec3; 3]) -> f32 {
    let pair = AxisPoint(point).closest_on_triangle(corners, f32::INFINITY);
    pair.map_or(f32::INFINITY, |pair| pair.distance_squared)
}

/// Upper bound on the smaller of two convex functions between two points, from their values there.
fn convex([one, other]: [f32; 2], [one_next, other_next]: [f32; 2]) -> f32 {
    let (most, other_most) = (larger(one_next, one), larger(other_next, other));
    smaller(other_most, most)
}

fn above_zero(x: f32) -> f32 {
    larger(0.0, x)
}

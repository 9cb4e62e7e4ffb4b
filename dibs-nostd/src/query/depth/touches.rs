//! Where an axis meets the surface. Between two such intervals it stays on one side of a closed surface.

use glam::Vec3;
use heapless::Vec;

use crate::TriangleRow;
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPair, AxisPoint, SLIVER, Tool};

/// Most intervals kept apart.
const TOUCHES: usize = 8;

/// Square of the sine of the angle between axis and triangle plane, 1/16. Below it, the length that touches the
/// triangle is found by bisection.
const INCLINED: f32 = 1.0 / 256.0;

const HALVINGS: u32 = 8;

/// The disjoint intervals in which an axis may meet the surface.
#[derive(Clone, Debug)]
pub(super) struct Touches {
    touches: Vec<Touch, TOUCHES>,
}

/// An interval of the axis that may meet the surface, in lengths from its start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    first: f32,
    last: f32,
    /// Whether the axis is outside before and after the interval; `None` if unknown.
    before: Option<bool>,
    after: Option<bool>,
    /// Parameter of a point of the axis in the interval.
    pub parameter: f32,
    /// A triangle that this point touches.
    pub triangle: TriangleRow,
}

impl Touch {
    const fn unknown(last: f32) -> Self {
        let (before, after, triangle) = (None, None, TriangleRow(0));
        Self { first: 0.0, last, before, after, parameter: 0.0, triangle }
    }

    /// The smallest interval that contains both.
    fn joined(&self, other: &Self) -> Self {
        let before = if self.before == other.before { self.before } else { None };
        let after = if self.after == other.after { self.after } else { None };
        let (first, last) = (smaller(other.first, self.first), larger(other.last, self.last));
        Self { first, last, before, after, ..*self }
    }
}

impl Touches {
    /// No interval.
    pub const NONE: Self = Self { touches: Vec::new() };

    /// The whole axis.
    pub fn anywhere() -> Self {
        let mut touches = Self::NONE;
        touches.push(Touch::unknown(f32::INFINITY));
        touches
    }

    /// Adds a triangle whose distance from the axis is within the accuracy. Returns the number of distances to it
    /// computed.
    ///
    /// An axis that is clearly inclined to a triangle and pierces it crosses the surface in the direction that the
    /// triangle faces. If by rounding it pierces a neighbour instead, that triangle is within the accuracy too, and
    /// both share one interval.
    pub fn add(
        &mut self,
        tool: &impl Tool,
        triangle: TriangleRow,
        corners: &[Vec3; 3],
        pair: &AxisPair,
        accuracy: f32,
    ) -> u32 {
        let length = tool.axis_length();
        let (start, along) = (tool.axis_start(), tool.axis_span() / length);
        let &[a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let (square, slope) = (normal.length_squared(), normal.dot(along));
        let is_clear = square > SLIVER * ab.length_squared() * ac.length_squared();
        let parameter = pair.axis_parameter;
        let middle = parameter * length;
        if is_clear && slope * slope > INCLINED * square {
            // The axis meets the plane within two accuracies divided by the sine; the larger factor covers rounding.
            let within = 8.0 * accuracy * sqrt(square / (slope * slope));
            let is_outward = (pair.distance_squared <= 0.0).then_some(slope > 0.0);
            let (first, last) = (middle - within, middle + within);
            let (before, after) = (is_outward.map(|is_outward| !is_outward), is_outward);
            self.insert(Touch { first, last, before, after, parameter, triangle });
            return 0;
        }
        let is_touched = |at: f32| {
            let point = AxisPoint(tool.axis_point(at / length));
            let pair = point.closest_on_triangle(corners, f32::INFINITY);
            pair.is_none_or(|pair| pair.distance_squared <= 4.0 * accuracy * accuracy)
        };
        // A point's distance to a triangle is convex along the axis.
        let end = |beyond: f32| {
            let (mut inside, mut outside) = (middle, beyond);
            for _ in 0..HALVINGS {
                let half = (inside + outside) * 0.5;
                *if is_touched(half) { &mut inside } else { &mut outside } = half;
            }
            outside
        };
        let [a, b, c] = [a, b, c].map(|corner| along.dot(corner - start));
        let first = smaller(smaller(smaller(middle, c), b), a) - 2.0 * accuracy;
        let last = larger(larger(larger(middle, c), b), a) + 2.0 * accuracy;
        let (first, last) = (end(first), end(last));
        self.insert(Touch { first, last, parameter, triangle, ..Touch::unknown(0.0) });
        2 * HALVINGS
    }

    /// Adds an interval, joined with all that it overlaps.
    fn insert(&mut self, mut touch: Touch) {
        self.touches.retain(|other| {
            let is_apart = other.last < touch.first || other.first > touch.last;
            if !is_apart {
                touch = touch.joined(other);
            }
            is_apart
        });
        for other in &mut self.touches {
            if other.first > touch.first {
                core::mem::swap(other, &mut touch);
            }
        }
        self.push(touch);
    }

    /// Appends an interval; if there is no room, joins it to the last one.
    fn push(&mut self, touch: Touch) {
        if let Err(touch) = self.touches.push(touch)
            && let Some(last) = self.touches.last_mut()
        {
            *last = Touch { before: None, after: None, ..last.joined(&touch) };
        }
    }

    /// The intervals, unless they are unknown.
    pub fn touches(&self) -> impl Iterator<Item = &Touch> {
        self.touches.iter().filter(|touch| touch.last < f32::INFINITY)
    }

    /// Notes that the axis is outside at this length.
    pub fn add_outside(&mut self, along: f32) {
        let mut previous: Option<&mut Touch> = None;
        for touch in &mut self.touches {
            if touch.first > along {
                touch.before.get_or_insert(true);
                break;
            }
            previous = (touch.last < along).then_some(touch);
            if previous.is_none() {
                return;
            }
        }
        if let Some(previous) = previous {
            previous.after.get_or_insert(true);
        }
    }

    /// The free length forward from a length along the axis.
    #[inline(never)] // Small code, see `side::of_point`.
    pub fn ahead(&self, along: f32) -> Free {
        let mut free = Free { from: along, to: f32::INFINITY, is_outside: false };
        let mut previous = None;
        for touch in &self.touches {
            if touch.first > free.from {
                return Free { to: touch.first, ..free.between(previous, touch.before) };
            }
            if touch.last >= free.from {
                free.from = touch.last;
            }
            previous = touch.after;
        }
        free.between(previous, None)
    }

    /// The free length backward.
    #[inline(never)]
    pub fn behind(&self, along: f32) -> Free {
        let mut free = Free { from: along, to: f32::NEG_INFINITY, is_outside: false };
        let mut next = None;
        for touch in self.touches.iter().rev() {
            if touch.last < free.from {
                return Free { to: touch.last, ..free.between(touch.after, next) };
            }
            if touch.first <= free.from {
                free.from = touch.first;
            }
            next = touch.before;
        }
        free.between(None, next)
    }
}

/// A length of the axis that does not meet the surface.
pub(super) struct Free {
    /// Its end nearer to the point of the request.
    pub from: f32,
    pub to: f32,
    /// It is certainly outside.
    pub is_outside: bool,
}

impl Free {
    /// Outside if one end is, and neither is inside.
    fn between(self, one: Option<bool>, other: Option<bool>) -> Self {
        let is_outside = one.or(other) == Some(true) && other.or(one) == Some(true);
        Self { is_outside, ..self }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use fastrand::Rng;

    use super::*;

    #[test]
    fn touches_that_overlap_are_one() {
        let mut rng = Rng::with_seed(7);
        let (mut joined, mut full) = (0, 0);
        for _ in 0..2_000 {
            let mut touches = Touches::NONE;
            let mut expected = Vec::<(f32, f32)>::new();
            for _ in 0..rng.usize(1..20) {
                let first = rng.f32() * 100.0;
                let last = first + rng.f32() * 8.0;
                touches.insert(Touch { first, last, ..Touch::unknown(0.0) });
                let (apart, over): (Vec<_>, Vec<_>) =
                    expected.into_iter().partition(|&(a, b)| b < first || a > last);
                joined += usize::from(over.len() > 1);
                let one = over
                    .iter()
                    .fold((first, last), |one, other| (one.0.min(other.0), one.1.max(other.1)));
                expected = apart;
                expected.push(one);
                expected.sort_by(|a, b| a.0.total_cmp(&b.0));
                // Without room the last two are joined.
                if expected.len() > TOUCHES
                    && let Some((_, last)) = expected.pop()
                {
                    full += 1;
                    expected[TOUCHES - 1].1 = last;
                }
                let found: Vec<_> = touches.touches().map(|at| (at.first, at.last)).collect();
                assert_eq!(found, expected);
            }
        }
        assert!(joined > 100 && full > 100, "{joined} {full}");
    }
}

//! The proof of a depth, kept from tick to tick.
//!
//! A depth changes by at most the motion of tool and surface. So every bound of the last tick still holds, plus that
//! motion: only parts of the axis whose bounds have come above the deepest point are looked at again.

use heapless::Vec;

use super::clock::{MotionClock, Reading};
use super::leaves::Leaves;
use crate::TriangleRow;
use crate::tree::RootSet;

/// Most points remembered, so that the next search has room for more.
const KEPT: usize = 20;

/// A point of the axis, and the part from there to the next one.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Point {
    /// 0 at the axis' start, 1 at its end.
    pub parameter: f32,
    /// Upper bound on its depth.
    pub depth: f32,
    /// No point of the part is deeper.
    pub bound: f32,
    /// A triangle near it.
    pub triangle: TriangleRow,
}

/// The last depth.
#[derive(Clone, Debug)]
pub(in crate::query) struct KnownDepth {
    points: Points,
    leaves: Leaves,
    /// The key of the shells that decided.
    shells: u32,
    /// The reading as of which the bounds hold.
    at: Reading,
}

/// The last depth, in a tick.
pub(in crate::query) struct KnownDepthMut<'m> {
    known: &'m mut KnownDepth,
    clock: MotionClock,
}

/// The points of the last depth.
#[derive(Clone, Debug)]
pub(in crate::query) struct Points {
    points: Vec<Point, KEPT>,
    /// The deepest point's parameter; not a number if no point was inside.
    deepest: f32,
}

impl KnownDepth {
    #[inline(always)]
    pub const fn new() -> Self {
        let points = Points { points: Vec::new(), deepest: f32::NAN };
        let shells = RootSet::ALL.key();
        Self { points, leaves: Leaves::new(), shells, at: Reading::START }
    }

    pub fn forget(&mut self) {
        self.points.forget();
        self.leaves.forget();
    }

    pub const fn at(&mut self, clock: MotionClock) -> KnownDepthMut<'_> {
        KnownDepthMut { known: self, clock }
    }
}

impl<'m> KnownDepthMut<'m> {
    pub fn forget(self) {
        self.known.forget();
    }

    /// The points with their bounds as of now, and the leaves around the deepest one, if the same shells decide.
    pub fn now(self, roots: RootSet) -> (&'m mut Points, &'m mut Leaves) {
        let Self { known, clock } = self;
        if known.shells != roots.key() {
            known.forget();
            known.shells = roots.key();
        }
        let moved = clock.since(known.at);
        if moved > 0 {
            let moved = clock.length(moved) * (1.0 + 4.0 * f32::EPSILON);
            for point in &mut known.points.points {
                point.depth = raised(point.depth, moved);
                point.bound = raised(point.bound, moved);
            }
            known.leaves.add_motion(moved);
            known.at = clock.now();
        }
        (&mut known.points, &mut known.leaves)
    }
}

impl Points {
    pub fn forget(&mut self) {
        self.points.clear();
    }

    /// The points from the axis' start to its end, and the deepest one's parameter, if a bound is still below `reach`.
    pub fn below(&self, reach: f32) -> Option<(&[Point], f32)> {
        let points = self.points.as_slice();
        let (_end, parts) = points.split_last()?;
        let is_known = parts.iter().any(|part| part.bound < reach);
        is_known.then_some((points, self.deepest))
    }

    /// Most points that it keeps.
    pub const MOST: usize = KEPT;

    /// Remembers the points of a search in order, and the parameter of the deepest one. A point without a triangle near it
    /// leaves nothing to remember.
    pub fn keep(&mut self, points: impl Iterator<Item = Option<Point>>, deepest: f32) {
        self.forget();
        self.deepest = deepest;
        for point in points.take(KEPT) {
            let Some(point) = point else { return self.forget() };
            let _ = self.points.push(point);
        }
    }
}

/// A bound after a motion, rounded up.
fn raised(bound: f32, moved: f32) -> f32 {
    let sum = bound + moved;
    sum + sum.abs() * f32::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Tree;
    use crate::surface::motion::Unit;

    #[test]
    fn no_motion_brings_back_a_forgotten_depth() {
        let mesh = dibs_build::generate::heart(320).unwrap().mesh;
        let built = dibs_build::Builder::new().build(&mesh).unwrap();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let mut clock = MotionClock::new(Unit::of(&tree));
        let mut known = KnownDepth::new();
        for _ in 0..5 {
            clock.advance(u32::MAX / 3);
            known.forget();
        }
        clock.advance(1 << 31);
        let (points, _) = known.at(clock).now(RootSet::ALL);
        assert!(points.below(f32::INFINITY).is_none());
    }
}

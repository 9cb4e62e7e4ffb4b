//! The proof of a depth, carried from tick to tick.
//!
//! A depth changes by at most the motion of tool and surface. So every bound of the last tick plus that motion still
//! holds: only parts of the axis whose bounds now exceed the deepest point are searched again.

// Requirements: S-03, T-01

use heapless::{Vec, VecView};

use super::clock::{MotionClock, Reading};
use super::leaves::Leaves;
use super::separation::CertainInterval;
use super::waiting::WaitingNode;
use crate::TriangleRow;
use crate::tree::RootSet;

/// Most points remembered; the next search has room for more.
const KEPT: usize = 20;

/// A point of the axis, and the segment from it to the next point.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Point {
    /// 0 at the axis' start, 1 at its end.
    pub parameter: f32,
    /// Upper bound on its depth.
    pub depth: f32,
    /// Upper bound on the depth in the segment.
    pub bound: f32,
    /// A triangle near it.
    pub triangle: TriangleRow,
}

#[derive(Clone, Debug)]
pub(in crate::query) struct KnownDepth<const STACK: usize> {
    state: DepthState,
    /// Subtrees still to be searched for the leaves around one of the two points.
    waiting: Vec<WaitingNode, STACK>,
}

#[derive(Clone, Debug)]
struct DepthState {
    points: Points,
    /// The leaves around the deepest point, and around one that may be deeper.
    leaves: [Leaves; 2],
    /// Identifies the shells that decided.
    shells: u32,
    /// The reading at which the bounds hold.
    at: Reading,
}

/// The last depth, in a tick.
pub(in crate::query) struct KnownDepthMut<'m> {
    state: &'m mut DepthState,
    waiting: &'m mut VecView<WaitingNode>,
    clock: MotionClock,
    past: Option<CertainInterval>,
}

/// The memory of a depth, updated to now.
pub(in crate::query) struct RememberedDepth<'m> {
    pub points: &'m mut Points,
    /// The leaves around the deepest point, and around one that may be deeper.
    pub leaves: &'m mut [Leaves; 2],
    /// Subtrees still to be searched for the leaves around one of the two points.
    pub waiting: &'m mut VecView<WaitingNode>,
    /// Lower and upper bound on the depth of the deepest point.
    pub between: [f32; 2],
}

#[derive(Clone, Debug)]
pub(in crate::query) struct Points {
    points: Vec<Point, KEPT>,
    /// The deepest point's parameter; NaN if no point was inside.
    deepest: f32,
}

impl<const STACK: usize> KnownDepth<STACK> {
    #[inline(always)]
    pub const fn new() -> Self {
        let points = Points { points: Vec::new(), deepest: f32::NAN };
        let leaves = [Leaves::new(), Leaves::new()];
        let state = DepthState { points, leaves, shells: RootSet::ALL.key(), at: Reading::START };
        Self { state, waiting: Vec::new() }
    }

    pub fn forget(&mut self) {
        self.state.forget();
        self.waiting.clear();
    }

    /// Whether the last tick left points of the axis to go on from.
    pub fn is_known(&self) -> bool {
        self.state.points.known().is_some()
    }

    /// The last depth at a reading, with the certain separation at that time.
    pub fn at(&mut self, clock: MotionClock, past: Option<CertainInterval>) -> KnownDepthMut<'_> {
        KnownDepthMut { state: &mut self.state, waiting: &mut self.waiting, clock, past }
    }
}

impl DepthState {
    fn forget(&mut self) {
        self.points.forget();
        self.leaves.iter_mut().for_each(Leaves::forget);
    }
}

impl<'m> KnownDepthMut<'m> {
    pub fn forget(self) {
        self.state.forget();
        self.waiting.clear();
    }

    /// Whether the axis may be inside, by the last certain separation.
    pub fn may_be_inside(&self) -> bool {
        self.past.is_some_and(|past| past.lower < 0.0)
    }

    /// The memory updated to now, if the same shells decide.
    pub fn now(self, roots: RootSet) -> RememberedDepth<'m> {
        let Self { state, waiting, clock, past } = self;
        if state.shells != roots.key() {
            state.forget();
            waiting.clear();
            state.shells = roots.key();
        }
        let moved = clock.moved_since(state.at);
        if moved.is_none() {
            state.forget();
            waiting.clear();
        }
        let DepthState { points, leaves, at, .. } = state;
        let moved = moved.unwrap_or(0.0);
        if moved > 0.0 {
            for point in &mut points.points {
                point.depth = raised(point.depth, moved);
                point.bound = raised(point.bound, moved);
            }
            leaves.iter_mut().for_each(|leaves| leaves.add_motion(moved));
        }
        *at = clock.now();
        // Of several solids another one may be deepest.
        let least = past.filter(|_| roots == RootSet::ALL).map_or(0.0, |past| -past.upper);
        let between = [least, past.map_or(f32::INFINITY, |past| -past.lower)];
        RememberedDepth { points, leaves, waiting, between }
    }
}

impl Points {
    pub fn forget(&mut self) {
        self.points.clear();
    }

    /// The points from the axis' start to its end, and the deepest one's parameter, if any.
    pub fn known(&self) -> Option<(&[Point], f32)> {
        (self.points.len() > 1).then_some((&self.points, self.deepest))
    }

    /// Most points kept.
    pub const MOST: usize = KEPT;

    /// Remembers a search's points in order, and the parameter of the deepest one. If a point has no triangle near it,
    /// nothing is remembered.
    pub fn keep(&mut self, points: impl Iterator<Item = Option<Point>>, deepest: f32) {
        self.forget();
        self.deepest = deepest;
        for point in points.take(KEPT) {
            let Some(point) = point else { return self.forget() };
            let _ = self.points.push(point);
        }
    }
}

/// A bound raised by a motion, rounded up.
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
        let mut known = KnownDepth::<8>::new();
        for _ in 0..5 {
            clock.advance(u32::MAX / 3);
            known.forget();
        }
        clock.advance(1 << 31);
        let RememberedDepth { points, .. } = known.at(clock, None).now(RootSet::ALL);
        assert!(points.known().is_none());
    }
}

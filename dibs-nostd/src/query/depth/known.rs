//! The proof of a depth, kept from tick to tick.
//!
//! A depth changes by at most the motion of tool and surface. So every bound of the last tick still holds, plus that
//! motion: only parts of the axis whose bounds have come above the deepest point are looked at again.

use super::part::{Part, Parts};
use crate::TriangleRow;
use crate::query::search::Around;
use crate::surface::motion::Unit;
use crate::tree::RootSet;

/// Most points remembered, so that the next search has room for more.
const KEPT: usize = 20;

/// A point of the axis, and the part from there to the next one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
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
pub(in crate::query) struct Known {
    points: Points,
    around: Around,
    /// The key of the shells that decided.
    shells: u32,
    unit: Unit,
    /// Motion of tool and surface since then, in units.
    moved: u32,
}

/// The points of the last depth.
#[derive(Clone, Debug)]
pub(in crate::query) struct Points {
    points: [Point; KEPT],
    count: usize,
    /// The deepest point's parameter; not a number if no point was inside.
    deepest: f32,
}

impl Known {
    pub const fn new(unit: Unit) -> Self {
        let none = Point { parameter: 0.0, depth: 0.0, bound: 0.0, triangle: TriangleRow(0) };
        let points = Points { points: [none; KEPT], count: 0, deepest: f32::NAN };
        Self { points, around: Around::new(), shells: RootSet::ALL.key(), unit, moved: 0 }
    }

    pub fn forget(&mut self) {
        self.points.forget();
        self.around.forget();
    }

    /// Tool and surface have moved.
    pub fn add_motion(&mut self, units: u32) {
        // More than the surface is large: no bound survives it.
        self.moved = self.moved.saturating_add(units).min(i32::MAX as u32);
    }

    /// The points with their bounds as of now, and the leaves around the deepest one, if the same shells decide.
    pub fn now(&mut self, roots: RootSet) -> (&mut Points, &mut Around) {
        if self.shells != roots.key() {
            self.forget();
            self.shells = roots.key();
        }
        if self.moved > 0 {
            let moved = self.unit.length(self.moved as i32) * (1.0 + 4.0 * f32::EPSILON);
            for point in &mut self.points.points {
                point.depth = raised(point.depth, moved);
                point.bound = raised(point.bound, moved);
            }
            self.around.add_motion(moved);
            self.moved = 0;
        }
        (&mut self.points, &mut self.around)
    }
}

impl Points {
    pub(super) fn forget(&mut self) {
        self.count = 0;
    }

    /// The points from the axis' start to its end, and the deepest one's parameter, if a bound is still below `reach`.
    pub(super) fn below(&self, reach: f32) -> Option<(&[Point], f32)> {
        let points = self.points.get(..self.count)?;
        let (_end, parts) = points.split_last()?;
        let is_known = parts.iter().any(|part| part.bound < reach);
        is_known.then_some((points, self.deepest))
    }

    /// Remembers the parts of a search, and the parameter of its deepest point.
    pub(super) fn keep(&mut self, parts: &mut Parts, deepest: f32) {
        while parts.count() > KEPT && parts.join(deepest, f32::INFINITY) {}
        (self.count, self.deepest) = (0, deepest);
        for (place, part) in self.points.iter_mut().zip(parts.in_order()) {
            let Part { from, bound, .. } = part;
            let Some(triangle) = from.triangle else { return self.forget() };
            *place = Point { parameter: from.parameter, depth: from.depth, bound, triangle };
            self.count += 1;
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

    #[test]
    fn no_motion_brings_back_a_forgotten_depth() {
        let mesh = dibs_build::generate::heart(320).unwrap().mesh;
        let built = dibs_build::Builder::new().build(&mesh).unwrap();
        let mut known = Known::new(Unit::of(&Tree::<u16>::from_bytes(built.blob()).unwrap()));
        for _ in 0..5 {
            known.add_motion(u32::MAX / 3);
            known.forget();
        }
        known.add_motion(1 << 31);
        let (points, _) = known.now(RootSet::ALL);
        assert!(points.below(f32::INFINITY).is_none());
    }
}

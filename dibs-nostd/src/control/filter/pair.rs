//! A filter's interface to a pair of tool and surface.

use glam::Vec3;

use crate::math::round::sum_down;
use crate::math::sqrt::sqrt;
use crate::query::{LabelDistance, NoSide, Proximity, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Options, Tool, Tracker};

/// A pair of tool and surface.
pub(super) trait Pair {
    /// The current ends of the tool's axis.
    fn ends(&self) -> [Vec3; 2];

    fn radius(&self) -> f32;

    /// Number of the tracker's opened nodes.
    fn opened(&self) -> u32;

    /// Number of the tracker's nodes with a bound that a search within a distance (mm) of the axis would test.
    fn due_within(&self, distance: f32) -> u32;

    /// The closest pair of the tool with its axis at other ends.
    fn closest(&mut self, ends: [Vec3; 2], options: &Options) -> Result<Proximity, QueryError>;

    /// The same of a label's triangles, within a distance (mm) of the axis.
    fn closest_of_label(
        &mut self,
        ends: [Vec3; 2],
        within: (u8, f32),
        options: &Options,
    ) -> Result<LabelDistance, QueryError>;
}

impl<I: Index, S, T: Tool, const STACK: usize, const OPENED: usize, const RANGE: usize> Pair
    for (&mut Tracker<'_, I, STACK, OPENED, RANGE>, &S, &T)
where
    S: MovingSurface + ?Sized,
{
    fn ends(&self) -> [Vec3; 2] {
        [self.2.axis_start(), self.2.axis_point(1.0)]
    }

    fn radius(&self) -> f32 {
        self.2.radius()
    }

    fn opened(&self) -> u32 {
        self.0.opened()
    }

    fn due_within(&self, distance: f32) -> u32 {
        self.0.due_within(distance)
    }

    fn closest(&mut self, ends: [Vec3; 2], options: &Options) -> Result<Proximity, QueryError> {
        let (tracker, surface, tool) = self;
        let tool = tool.with_axis(ends);
        Ok(tracker.closest(*surface, &tool, options)?.closest)
    }

    fn closest_of_label(
        &mut self,
        ends: [Vec3; 2],
        within: (u8, f32),
        options: &Options,
    ) -> Result<LabelDistance, QueryError> {
        let (tracker, surface, tool) = self;
        tracker.closest_of_label(*surface, &tool.with_axis(ends), within, options)
    }
}

/// The closest pair of a tool and a surface, or a label's part of it.
#[derive(Clone, Copy)]
pub(super) struct ClosestPair {
    /// A lower bound on the axis' distance; negative inside, and negative infinity where nothing is certain.
    pub distance: f32,
    /// The pair's distance, without a sign.
    pub axis_distance: f32,
    pub axis_parameter: f32,
    /// Out of the surface; zero where that is not known.
    pub direction: Vec3,
    pub node_tests: u32,
    pub triangle_tests: u32,
}

impl ClosestPair {
    /// Of a whole surface. A tool that `is_outside` at the start of its path needs no side later.
    #[inline(always)]
    pub fn of(found: &Proximity, radius: f32, is_outside: bool) -> Self {
        let distance = distance(found, radius, is_outside);
        let &Proximity { axis_distance, axis_parameter, direction, .. } = found;
        let &Proximity { node_tests, triangle_tests, .. } = found;
        Self { distance, axis_distance, axis_parameter, direction, node_tests, triangle_tests }
    }

    /// Of a label's part.
    pub fn of_label(found: &LabelDistance) -> Self {
        let &LabelDistance { distance, pair, node_tests, triangle_tests } = found;
        let (axis_parameter, direction) = pair.map_or((0.0, Vec3::ZERO), |pair| {
            let towards = pair.on_axis - pair.on_surface;
            (pair.axis_parameter, towards / sqrt(towards.length_squared()))
        });
        let axis_distance = distance;
        Self { distance, axis_distance, axis_parameter, direction, node_tests, triangle_tests }
    }
}

/// A lower bound on the axis' distance; negative inside, and negative infinity if nothing is certain. A tool that
/// `is_outside` at the start of its path needs no side later: it would have to touch the surface first.
fn distance(found: &Proximity, radius: f32, is_outside: bool) -> f32 {
    let lower = match found.side {
        Side::Outside | Side::Inside | Side::Crossing | Side::Either => found.lower,
        // Without a solid there is no inside.
        Side::Undefined(
            NoSide::OpenBoundary | NoSide::NonManifold | NoSide::NoAdjacency | NoSide::NotAsked,
        ) => found.lower,
        Side::Undefined(_) if is_outside => found.lower,
        Side::Undefined(_) if found.is_at_surface() => {
            sum_down(found.lower, -2.0 * found.axis_distance)
        }
        Side::Undefined(_) => f32::NEG_INFINITY,
    };
    sum_down(sum_down(lower, radius), -found.accuracy)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An answer 5 mm from the surface, or this far, for a tool of 2 mm with an error of 0.5 mm.
    fn bound(side: Side, axis_distance: f32, is_outside: bool) -> f32 {
        let found = Proximity {
            separation: 5.0,
            lower: 5.0,
            accuracy: 0.5,
            side,
            axis_distance,
            point_on_surface: Vec3::ZERO,
            ..Proximity::NOWHERE
        };
        distance(&found, 2.0, is_outside)
    }

    /// Without a side the axis may be inside, unless it was outside before, or no inside exists.
    #[test]
    fn a_missing_side_counts_as_its_reason_says() {
        let close = |bound: f32, expected: f32| (bound - expected).abs() < 1e-5;
        for side in [Side::Outside, Side::Undefined(NoSide::OpenBoundary)] {
            assert!(close(bound(side, 7.0, false), 6.5), "{side:?}");
        }
        for reason in [NoSide::BelowAccuracy, NoSide::CutShort, NoSide::Degenerate] {
            let side = Side::Undefined(reason);
            assert!(close(bound(side, 7.0, true), 6.5), "{reason:?}");
            assert!(bound(side, 7.0, false) == f32::NEG_INFINITY, "{reason:?}");
        }
        // At the surface it is inside by no more than twice its distance from there.
        let at_surface = Side::Undefined(NoSide::BelowAccuracy);
        assert!(close(bound(at_surface, 0.25, false), 6.0));
        assert!(bound(Side::Undefined(NoSide::CutShort), 0.25, false) == f32::NEG_INFINITY);
    }
}

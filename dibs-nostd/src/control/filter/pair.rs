//! A filter's interface to a pair of tool and surface.

use glam::Vec3;

use crate::math::round::sum_down;
use crate::query::{NoSide, Proximity, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Options, Tool, Tracker};

/// A pair of tool and surface.
pub(super) trait Pair {
    /// The current ends of the tool's axis.
    fn ends(&self) -> [Vec3; 2];

    fn radius(&self) -> f32;

    /// The closest pair of the tool with its axis at other ends.
    fn closest(&mut self, ends: [Vec3; 2], options: &Options) -> Result<Proximity, QueryError>;
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

    fn closest(&mut self, ends: [Vec3; 2], options: &Options) -> Result<Proximity, QueryError> {
        let (tracker, surface, tool) = self;
        let tool = tool.with_axis(ends);
        Ok(tracker.closest(*surface, &tool, options)?.closest)
    }
}

/// A lower bound on the axis' distance; negative inside, and negative infinity if nothing is certain. A tool that
/// `is_outside` at the start of its path needs no side later: it would have to touch the surface first.
pub(super) fn distance(found: &Proximity, radius: f32, is_outside: bool) -> f32 {
    let lower = match found.side {
        Side::Outside | Side::Inside | Side::Crossing => found.lower,
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

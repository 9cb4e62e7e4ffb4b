//! Distances that a tick's queries found, and what they say of other poses.

use glam::Vec3;

use crate::math::order::larger;
use crate::math::sqrt::sqrt;

/// A pair's distance at a pose.
#[derive(Clone, Copy)]
pub(super) struct PoseDistance {
    /// Ends of the axis.
    pub ends: [Vec3; 2],
    /// Lower bound on the axis' distance from the surface; negative inside.
    pub distance: f32,
}

impl PoseDistance {
    /// Upper bound on the motion of the axis to other ends, rounded up.
    pub fn moved(&self, ends: &[Vec3; 2]) -> f32 {
        let mut most = 0.0;
        for (from, to) in self.ends.iter().zip(ends) {
            let square = from.distance_squared(*to);
            if square > most {
                most = square;
            }
        }
        sqrt(most) * (1.0 + 8.0 * f32::EPSILON)
    }

    /// A lower bound on the distance at other ends.
    pub fn distance_at(&self, ends: &[Vec3; 2]) -> f32 {
        self.distance - self.moved(ends)
    }
}

/// A pair in this tick, or a part of its surface.
#[derive(Clone, Copy)]
pub(super) struct PairState {
    pub start: PoseDistance,
    /// The last pose searched after the start.
    pub end: Option<PoseDistance>,
    /// The distance minus this is a lower bound on the separation at the start.
    pub reach: f32,
    /// The least distance allowed during the motion.
    pub least: f32,
    /// The distance of the closest pair found at the start, without its sign.
    pub axis_distance: f32,
}

impl PairState {
    /// What both poses say of the distance at other ends.
    pub fn distance_at(&self, ends: &[Vec3; 2]) -> f32 {
        let at = self.start.distance_at(ends);
        match self.end {
            Some(end) => larger(at, end.distance_at(ends)),
            None => at,
        }
    }
}

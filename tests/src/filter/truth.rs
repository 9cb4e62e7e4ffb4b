//! The truth about a tick, by exhaustive search in f64.

use dibs_nostd::filter::RigidMotion;
use glam::{DQuat, DVec3, Vec3};

use super::{Course, Scene};
use crate::oracle::least_distance;

/// The true surface in a tick, and the tools.
pub struct Truth<'a> {
    /// The surface at rest.
    pub scene: &'a Scene,
    /// How it moves.
    pub course: Course,
    /// The tick's start (s).
    pub start: f64,
    /// s.
    pub period: f64,
    /// The tools' radii.
    pub radii: [f32; 2],
    /// Labels, and by how much their stand-offs are larger than the filter's.
    pub labels: &'a [(u8, f64)],
}

/// Least separations (mm) of any tool.
#[derive(Clone, Copy)]
pub struct Separations {
    /// From the whole surface.
    pub whole: f64,
    /// From the whole surface, or from a label's triangles less what their stand-off is larger.
    pub room: f64,
}

impl Separations {
    /// The lesser of each.
    pub fn or_less(self, other: Self) -> Self {
        Self { whole: self.whole.min(other.whole), room: self.room.min(other.room) }
    }
}

impl Truth<'_> {
    /// The least separations of any tool at a fraction of the tick.
    pub fn separations(
        &self,
        axes: &[[Vec3; 2]; 2],
        motion: &RigidMotion,
        share: f64,
        by_arc: bool,
    ) -> Separations {
        let time = self.start + share * self.period;
        let rows: Vec<DVec3> = self.scene.rest.iter().map(|&p| self.course.at(p, time)).collect();
        let about = motion.about.as_dvec3();
        let turn = |share: f64| DQuat::from_scaled_axis(motion.rotation.as_dvec3() * share);
        let at = |point: Vec3, share: f64| {
            about + turn(share) * (point.as_dvec3() - about) + motion.translation.as_dvec3() * share
        };
        let place = |point: Vec3| {
            if by_arc { at(point, share) } else { point.as_dvec3().lerp(at(point, 1.0), share) }
        };
        let of = |label: Option<u8>| {
            let mut least = f64::INFINITY;
            for (axis, radius) in axes.iter().zip(self.radii) {
                let [start, end] = axis.map(place);
                let rows_of = self.scene.triangles.iter().enumerate().filter(|&(row, _)| {
                    label.is_none_or(|label| self.scene.labels.get(row) == Some(&label))
                });
                let triangles = rows_of.map(|(_, t)| t.map(|v| rows[v as usize]));
                least = least.min(least_distance(start, end, triangles) - f64::from(radius));
            }
            least
        };
        let whole = of(None);
        let room = |least: f64, &(label, more): &(u8, f64)| least.min(of(Some(label)) - more);
        Separations { whole, room: self.labels.iter().fold(whole, room) }
    }
}

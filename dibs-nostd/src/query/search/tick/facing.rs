//! The plane perpendicular to the closest pair.

use glam::Vec3;

use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::query::plane::least;
use crate::query::search::Search;
use crate::query::search::slack::ACCURACY;
use crate::{Index, Tool, VertexTable};

/// The plane perpendicular to the closest pair. Most triangles around the pair are beyond it, and triangles that share
/// the closest point are not nearer; neither kind needs an exact test.
pub(super) struct FacingPlane {
    start: Vec3,
    /// Unit vector from the axis to the closest triangle; zero if there is none, or they touch.
    normal: Vec3,
    /// The axis' largest coordinate along the normal, from its start.
    foremost: f32,
    /// Triangles farther than this along the normal cannot be closer than the closest one by more than the accuracy.
    pub within: f32,
}

impl FacingPlane {
    /// The plane of the closest pair so far.
    #[inline(always)]
    pub fn new<I: Index, V: VertexTable + ?Sized, T: Tool>(
        search: &Search<'_, '_, I, V, T>,
    ) -> Self {
        let start = search.tool.axis_start();
        let none = Self { start, normal: Vec3::ZERO, foremost: 0.0, within: f32::INFINITY };
        let Some(pair) = search.best else { return none };
        let across = pair.on_surface - pair.on_axis;
        let length = sqrt(across.dot(across));
        if !(length > search.slack) {
            return none;
        }
        let normal = across / length;
        let end = normal.dot(search.tool.axis_span());
        let foremost = larger(0.0, end);
        let within = sqrt(pair.distance_squared) - ACCURACY * search.scale;
        Self { start, normal, foremost, within }
    }

    /// A lower bound on a triangle's distance from the axis.
    #[inline(always)]
    pub fn lowest(&self, corners: &[Vec3; 3]) -> f32 {
        least(corners.map(|corner| self.normal.dot(corner - self.start))) - self.foremost
    }
}

//! The answer of a search.

// Requirement: A-03

use glam::Vec3;

use super::slack::{ACCURACY, FLOOR};
use super::{NearestPin, Search};
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::query::{NoSide, Proximity, Side};
use crate::{Coverage, Index, QueryError, Tool, TriangleRow, VertexTable};

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// The error (mm) of a distance, without that of the table's positions.
    #[inline(always)]
    pub fn accuracy(&self) -> f32 {
        ACCURACY * self.scale + FLOOR + self.tree.position_error()
    }

    /// The answer, given the lower bound `lower` of the unexplored subtrees.
    pub(super) fn finish(&self, lower: f32) -> Result<Proximity, QueryError> {
        let NearestPin { row: pin, distance: pin_distance } = self.nearest_pin;
        let radius = self.tool.radius();
        let cut_short = lower < f32::INFINITY;
        let (pair, triangle, corners) = match self.best {
            Some(pair) if !cut_short || sqrt(pair.distance_squared) <= pin_distance => {
                let row = self.best_triangle;
                let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
                (pair, Some(TriangleRow(row)), corners)
            }
            _ if cut_short => {
                let position = self.position(pin)?;
                let point = self.tool.closest_on_triangle(&[position; 3], f32::INFINITY);
                (point.ok_or(QueryError::Position { vertex: pin })?, None, [pin; 3])
            }
            _ => return Err(QueryError::Uncovered { pin }),
        };
        let axis_distance = sqrt(pair.distance_squared);
        let made = self.meter.made();
        let above_zero = |x: f32| larger(0.0, x);
        let separation = axis_distance - radius;
        let left = above_zero(lower) - radius;
        // Divided by the vector's own length: near contact the points' rounding differs from the distance's.
        let towards = pair.on_axis - pair.on_surface;
        let length = sqrt(towards.length_squared());
        let touches = axis_distance <= 0.0 || length <= 0.0;
        let direction = if touches { Vec3::ZERO } else { towards / length };
        Ok(Proximity {
            separation,
            lower: smaller(separation, left),
            accuracy: self.accuracy(),
            side: Side::Undefined(NoSide::NotAsked),
            coverage: Coverage::Assumed,
            axis_distance,
            point_on_surface: pair.on_surface,
            point_on_tool: pair.on_axis - direction * radius,
            direction,
            axis_parameter: pair.axis_parameter,
            triangle,
            corners,
            barycentric: pair.barycentric,
            node_tests: made.node_tests.saturating_add(1),
            triangle_tests: made.triangle_tests,
        })
    }
}

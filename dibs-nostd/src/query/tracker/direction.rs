//! The direction where triangles tie.
//!
//! On the medial axis the last digits of a pose decide which triangle is the closest, and a force along its direction
//! would oscillate. So an answer keeps the last answer's triangle while it may be the closest within the rounding of
//! the two distances. The position error is not included: within it the nearer wall still counts as nearer.

// Requirement: T-03

use glam::Vec3;

use super::Tracker;
use super::kept::DIRECTED;
use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::query::corners::corners;
use crate::query::memory::separation::CertainInterval;
use crate::query::plane::least;
use crate::query::{Budget, Options, Proximity, Side};
use crate::tool::{AxisPoint, Tool};
use crate::unavailable::QueryError;
use crate::{Index, TriangleRow, VertexTable};

/// The cosine of the least turn that is examined: 8 degrees. As a tool slides along a surface, its direction turns by
/// less in a tick, and the last triangle need not be tested.
const TURNED: f32 = 0.99;

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// Keeps the last tick's direction where its triangle may still be the closest.
    #[inline(always)]
    pub(super) fn keep_direction<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
    ) -> Result<(), QueryError> {
        match self.memory.separation.last() {
            Some(last) if last.direction.dot(found.direction) < TURNED => {
                self.take_tied(vertices, tool, options, found, last)
            }
            _ => Ok(()),
        }
    }

    /// Replaces an answer's triangle by the last tick's if the two tie, belong to the same solid and are seen from the
    /// same side.
    #[cold]
    #[inline(never)]
    fn take_tied<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
        last: &CertainInterval,
    ) -> Result<(), QueryError> {
        let tree = &self.tree;
        let (Some(TriangleRow(row)), Some(TriangleRow(other))) = (last.triangle, found.triangle)
        else {
            return Ok(());
        };
        let is_outside = found.side == Side::Outside;
        // At an open surface the other sheet may be seen from its inner side.
        let is_possible = match found.side {
            Side::Undefined(_) => false,
            Side::Outside => last.side == Side::Outside && !found.is_cut_short(),
            _ => last.side != Side::Outside && tree.root_of(row) == tree.root_of(other),
        };
        let left = options.after(found.tests()).budget.tests();
        if row == other || !tree.is_closed() || !is_possible || left < Budget::TRIANGLE {
            return Ok(());
        }
        let (rows, corners) = corners(tree, vertices, row)?;
        let at = tool.axis_point(found.axis_parameter);
        let closest = sqrt(at.distance_squared(found.point_on_surface));
        // Only rounding: the surface's own error moves both triangles, and within it the nearer one counts.
        let tie = 2.0 * found.accuracy;
        // A plane perpendicular to the last pair rejects most triangles that do not tie.
        let (from, across, span) = if is_outside {
            (tool.axis_start(), -last.direction, tool.axis_span())
        } else {
            (at, last.direction, Vec3::ZERO)
        };
        let end = across.dot(span);
        let foremost = larger(0.0, end);
        if least(corners.map(|corner| across.dot(corner - from))) - foremost > closest + 2.0 * tie {
            return Ok(());
        }
        found.triangle_tests += 1;
        let pair = if is_outside {
            tool.closest_on_triangle(&corners, f32::INFINITY)
        } else {
            AxisPoint(at).closest_on_triangle(&corners, f32::INFINITY)
        };
        let pair = pair.ok_or(QueryError::Position { vertex: rows[0] })?;
        let towards = pair.on_axis - pair.on_surface;
        let length = sqrt(towards.length_squared());
        if !(length > DIRECTED * found.accuracy && length <= closest + tie) {
            return Ok(());
        }
        let outward = if is_outside { towards / length } else { -towards / length };
        if outward.dot(last.direction) > found.direction.dot(last.direction) {
            if is_outside {
                found.axis_parameter = pair.axis_parameter;
            }
            found.direction = outward;
            found.point_on_surface = pair.on_surface;
            found.point_on_tool = pair.on_axis - outward * tool.radius();
            found.barycentric = pair.barycentric;
            (found.triangle, found.corners) = (last.triangle, rows);
        }
        Ok(())
    }
}

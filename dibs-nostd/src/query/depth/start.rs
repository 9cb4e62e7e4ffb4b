//! The initial parts of the axis: between its intersections with the surface, or the last tick's parts.

use super::part::{Part, Parts, Sample};
use super::touches::Touches;
use super::{DISTANCE_COST, Depth};
use crate::math::order::smaller;
use crate::query::Proximity;
use crate::query::memory::depth::Point;
use crate::query::prices::POINT;
use crate::tool::Tool;
use crate::unavailable::QueryError;
use crate::{Index, TriangleRow, VertexTable};

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'_, '_, I, V, T> {
    /// Finds where the axis meets the triangles that a search found to touch it.
    pub(super) fn find_touches(&mut self) -> Result<(), QueryError> {
        if self.is_inside {
            self.touches = Touches::NONE;
            return Ok(());
        }
        if !self.ties.has_touched() {
            return Ok(());
        }
        self.touches = Touches::NONE;
        let mut next = 0;
        loop {
            let row = match (self.ties.touched_from(next), self.closest.triangle) {
                (Some((at, row)), _) => {
                    next = at + 1;
                    row
                }
                // A tracker's accuracy is larger than a search's, so the closest triangle may not be among the touched
                // ones.
                (None, Some(TriangleRow(row))) if next == 0 => {
                    next = usize::MAX;
                    row
                }
                _ => return Ok(()),
            };
            if self.is_spent() {
                self.touches = Touches::anywhere();
                return Ok(());
            }
            let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
            let corners = self.corners(corners)?;
            if let Some(pair) = self.tool.closest_on_triangle(&corners, f32::INFINITY) {
                let accuracy = self.closest.accuracy;
                let touches = &mut self.touches;
                let distances = touches.add(self.tool, TriangleRow(row), &corners, &pair, accuracy);
                self.spend((1 + distances) * DISTANCE_COST);
            }
        }
    }

    /// The parts between the axis' ends and its intersections with the surface. A tracker does this once.
    #[cold]
    #[inline(never)]
    pub(super) fn begin(
        &mut self,
        parts: &mut Parts,
        reach: f32,
        tolerance: f32,
    ) -> Result<(), QueryError> {
        let &Proximity { axis_parameter, axis_distance, accuracy, triangle, corners, .. } =
            self.closest;
        let depth = axis_distance + accuracy;
        let closest = self.sample(axis_parameter, depth, triangle, corners)?;
        let start = self.end(0.0, &closest, tolerance)?;
        let end = self.end(1.0, &closest, tolerance)?;
        parts.push(Part::remembered(start, 1, reach));
        for touch in self.touches.touches() {
            let row = touch.triangle.0;
            let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
            let sample = self.sample(touch.parameter, depth, Some(touch.triangle), corners)?;
            parts.push(Part::remembered(sample, parts.count() + 1, reach));
        }
        let is_end = axis_parameter <= 0.0 || axis_parameter >= 1.0;
        if parts.count() < 2 && !is_end {
            parts.push(Part::remembered(closest, 2, reach));
        }
        parts.push(Part::remembered(end, 0, 0.0));
        parts.end();
        Ok(())
    }

    /// Whether the point is that of the closest pair of an axis inside, usually one of its ends.
    fn is_searched(&self, parameter: f32) -> bool {
        self.is_inside && self.closest.axis_parameter == parameter
    }

    /// The sample of an end of the axis; not searched if it is known or certainly outside.
    fn end(&mut self, parameter: f32, near: &Sample, tolerance: f32) -> Result<Sample, QueryError> {
        if self.is_searched(parameter) {
            return Ok(*near);
        }
        let along = parameter * self.tool.axis_length();
        let touches = &self.touches;
        let free = if parameter > 0.0 { touches.behind(along) } else { touches.ahead(along) };
        if free.is_outside && free.from == along {
            return Ok(self.at(parameter, 0.0, near));
        }
        let most = near.depth + (along - near.along).abs();
        self.measure(self.at(parameter, most, near), self.enough(tolerance))
    }

    /// The last tick's parts, each at most `reach` deep. Returns the parameter of the deepest point, if there are any.
    pub(super) fn resume(&mut self, parts: &mut Parts, reach: f32) -> Option<f32> {
        let (points, deepest) = self.remembered.as_ref()?.points.known()?;
        let price = POINT * points.len() as u32;
        for point in points {
            let Point { parameter, depth, bound, triangle } = *point;
            let triangle = Some(triangle);
            let from = self.at(parameter, depth, &Sample { triangle, ..Sample::NONE });
            if depth < 0.0 {
                self.touches.add_outside(from.along);
            }
            parts.push(Part::remembered(from, parts.count() + 1, smaller(reach, bound)));
        }
        parts.end();
        self.spend_if_priced(price);
        Some(deepest)
    }
}

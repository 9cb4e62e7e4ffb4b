//! A tool's axis at an earlier tick.

use glam::Vec3;

use crate::Tool;
use crate::math::order::larger;
use crate::math::round::U;
use crate::math::sqrt::sqrt;
use crate::surface::motion::Unit;

#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Axis {
    start: Vec3,
    span: Vec3,
    length: f32,
}

impl Axis {
    pub fn of(tool: &impl Tool) -> Self {
        Self { start: tool.axis_start(), span: tool.axis_span(), length: tool.axis_length() }
    }

    /// Upper bound on the motion of any point of the axis, in units: the larger of the ends' steps. For another tool,
    /// the distance between the axes' points.
    #[inline(always)]
    pub fn step(&self, tool: &impl Tool, unit: Unit) -> u32 {
        let (start, end) = (tool.axis_start() - self.start, tool.axis_span() - self.span);
        if start == Vec3::ZERO && end == Vec3::ZERO {
            return 0;
        }
        let (start, end) = (start.length_squared(), (start + end).length_squared());
        let square = larger(end, start);
        // Each component of a span is off by at most `2 U` of the axis' length; a difference rounds by `U` of itself.
        let rounding = 8.0 * U * (tool.axis_length() + self.length);
        unit.up(sqrt(square) * (1.0 + 16.0 * U) + rounding)
    }
}

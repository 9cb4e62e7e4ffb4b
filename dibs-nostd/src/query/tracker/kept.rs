//! Fills in what a tick's search left open, from earlier ticks.
//!
//! Two intervals hold the signed distance: the search's, and the last tick's widened by the motion. So does their
//! intersection. It decides most sides that a search leaves open; where it does not, a constraint acts on its lower
//! end, along the direction of the last pair.
//!
//! The side of an open surface is that of its closest sheet, which can change without contact: there the last tick is
//! used only if a search finds no side.

// Requirement: T-02

use glam::Vec3;

use super::Tracker;
use crate::math::order::larger;
use crate::math::round::{sum_down, sum_up};
use crate::math::sqrt::sqrt;
use crate::query::corners::corners;
use crate::query::memory::separation::CertainInterval;
use crate::query::{Budget, NoSide, Options, Proximity, Side};
use crate::tool::AxisPoint;
use crate::unavailable::QueryError;
use crate::{Index, Tool, TriangleRow, VertexTable};

/// A pair closer than this many accuracies has no reliable direction.
pub(super) const DIRECTED: f32 = 8.0;

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// Narrows an answer to the interval that the last tick allows, and remembers it for the next tick. The answer's
    /// accuracy is without the table's position error, which does not limit the motion. Returns whether the side is the
    /// last tick's.
    #[inline(never)]
    pub(super) fn keep_certain<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
        nearest: f32,
    ) -> Result<bool, QueryError> {
        let clock = self.memory.clock;
        let last = self.memory.separation.now(clock);
        let was_open = matches!(found.side, Side::Undefined(_));
        let own = match found.side {
            Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency) => return Ok(false),
            Side::Undefined(_) => match last {
                Some(last) => self.without_side(vertices, tool, options, found, last, nearest)?,
                None => None,
            },
            _ => {
                if found.direction == Vec3::ZERO
                    && let Some(last) = last
                {
                    found.direction = last.direction;
                    found.point_on_tool -= last.direction * tool.radius();
                }
                let own = CertainInterval::of(found, tool.radius());
                // A smaller gain is the rounding of two answers.
                let gain = 2.0 * found.accuracy;
                let is_narrower = |last: &CertainInterval| {
                    last.lower > own.lower + gain || last.upper < own.upper - gain
                };
                match last.filter(|last| self.tree.is_closed() && is_narrower(last)) {
                    Some(last) => Some(self.narrow(vertices, tool, options, found, own, last)?),
                    None => Some(own),
                }
            }
        };
        match own {
            Some(certain) => self.memory.separation.keep(certain, clock),
            None => self.memory.separation.forget(),
        }
        Ok(was_open && !matches!(found.side, Side::Undefined(_)))
    }

    /// Narrows an answer with a side to the last tick's interval.
    #[cold]
    fn narrow<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
        own: CertainInterval,
        last: CertainInterval,
    ) -> Result<CertainInterval, QueryError> {
        let mut both = own;
        if last.lower > own.lower {
            both.lower = last.lower;
        }
        if last.upper < own.upper {
            both.upper = last.upper;
        }
        // Impossible: the motion was larger than stated.
        if both.lower > both.upper {
            return Ok(own);
        }
        if last.upper + 2.0 * found.accuracy < own.upper {
            // The last pair is deeper than any pair of this search.
            self.take_pair(vertices, tool, options, found, &last)?;
        }
        both.set_ends(found, tool.radius());
        Ok(both.with_pair_of(found))
    }

    /// Gives an answer without a side the side that the last tick allows.
    #[cold]
    fn without_side<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
        last: CertainInterval,
        nearest: f32,
    ) -> Result<Option<CertainInterval>, QueryError> {
        let own = CertainInterval::of(found, tool.radius());
        let has_depth = found.lower < nearest;
        let unsigned = CertainInterval::of(&Proximity { lower: nearest, ..*found }, tool.radius());
        let nearest = larger(0.0, unsigned.lower);
        let mut both = last;
        if own.upper < both.upper {
            both.upper = own.upper;
        }
        // No point of the axis is deeper than its distance to the pair.
        let deepest = -(found.axis_distance + found.accuracy + tool.axis_length()) * (1.0 + SUMS);
        let deepest = if has_depth && own.lower > deepest { own.lower } else { deepest };
        if deepest > both.lower {
            both.lower = deepest;
        }
        let is_at_surface = found.is_at_surface();
        if is_at_surface {
            // The pair is the search's. Another part of the axis may be inside, as deep as the interval allows.
            found.direction = last.direction;
            if both.lower > both.upper {
                return Ok(None);
            }
            found.side = Side::Either;
        } else if both.lower > -nearest {
            // The motion was too small to reach the inside.
            if nearest > both.lower {
                both.lower = nearest;
            }
            if both.lower > both.upper {
                return Ok(None);
            }
            found.side = Side::Outside;
            if !face_surface(found, tool) {
                self.take_pair(vertices, tool, options, found, &last)?;
            }
        } else {
            if both.upper < nearest {
                // The motion was too small to reach the outside.
                if -nearest < both.upper {
                    both.upper = -nearest;
                }
                if both.lower > both.upper {
                    return Ok(None);
                }
                found.side = if nearest > 0.0 { Side::Inside } else { Side::Crossing };
            } else {
                found.side = Side::Either;
            }
            self.take_pair(vertices, tool, options, found, &last)?;
        }
        both.set_ends(found, tool.radius());
        Ok(Some(if is_at_surface { both } else { both.with_pair_of(found) }))
    }

    /// Makes the last tick's pair, at its current positions, the answer's pair.
    #[cold]
    fn take_pair<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tool: &T,
        options: &Options,
        found: &mut Proximity,
        last: &CertainInterval,
    ) -> Result<(), QueryError> {
        let on_axis = tool.axis_point(last.axis_parameter);
        found.axis_parameter = last.axis_parameter;
        found.direction = last.direction;
        if let Some(TriangleRow(row)) = last.triangle
            && options.after(found.tests()).budget.tests() >= Budget::TRIANGLE
        {
            found.triangle_tests += 1;
            let (rows, corners) = corners(&self.tree, vertices, row)?;
            let pair = AxisPoint(on_axis).closest_on_triangle(&corners, f32::INFINITY);
            let pair = pair.ok_or(QueryError::Position { vertex: rows[0] })?;
            let towards = on_axis - pair.on_surface;
            let outward = if last.side == Side::Outside { towards } else { -towards };
            let length = sqrt(towards.length_squared());
            if length > DIRECTED * found.accuracy && outward.dot(last.direction) > 0.0 {
                found.direction = outward / length;
            }
            found.point_on_surface = pair.on_surface;
            found.barycentric = pair.barycentric;
            (found.triangle, found.corners) = (last.triangle, rows);
        }
        found.point_on_tool = on_axis - found.direction * tool.radius();
        Ok(())
    }
}

/// Rounding of the two sums from a separation to the axis and back, with slack for the rounding of the bound itself.
const SUMS: f32 = 4.0 / 16_777_216.0;

impl CertainInterval {
    /// The certain interval of an answer for the axis.
    #[inline(always)]
    fn of(found: &Proximity, radius: f32) -> Self {
        let accuracy = found.accuracy;
        let lower = found.lower + radius - accuracy;
        let upper = found.separation + radius + accuracy;
        let (side, direction) = (found.side, found.direction);
        let Proximity { axis_parameter, triangle, .. } = *found;
        Self {
            lower: lower - (lower.abs() + accuracy) * SUMS,
            upper: upper + (upper.abs() + accuracy) * SUMS,
            side,
            axis_parameter,
            triangle,
            direction,
        }
    }

    fn with_pair_of(self, found: &Proximity) -> Self {
        Self { lower: self.lower, upper: self.upper, ..Self::of(found, 0.0) }
    }

    #[inline(always)]
    fn set_ends(&self, found: &mut Proximity, radius: f32) {
        found.lower = sum_down(sum_down(self.lower, -radius), found.accuracy);
        found.separation = sum_up(sum_up(self.upper, -radius), -found.accuracy);
        if found.lower > found.separation {
            found.lower = found.separation;
        }
    }
}

/// Gives an answer the direction of a tool outside. Returns whether its points are far enough apart.
#[cold]
fn face_surface(found: &mut Proximity, tool: &impl Tool) -> bool {
    let on_axis = tool.axis_point(found.axis_parameter);
    let towards = on_axis - found.point_on_surface;
    let length = sqrt(towards.length_squared());
    if !(length > DIRECTED * found.accuracy) {
        return false;
    }
    found.direction = towards / length;
    found.point_on_tool = on_axis - found.direction * tool.radius();
    true
}

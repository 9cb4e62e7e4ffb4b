//! Steps from a triangle to closer neighbours. The distance to any triangle is an upper bound on a point's depth, so a
//! close triangle may save a search.

use super::part::{self, Fit, Parts, Sample};
use super::{DISTANCE_COST, Depth};
use crate::math::order::smaller;
use crate::math::sqrt::sqrt;
use crate::query::prices::STEP;
use crate::tool::Tool;
use crate::unavailable::QueryError;
use crate::{Index, TriangleRow, VertexTable};

const STEPS: u32 = 4;

/// Most steps of a walk, and what a distance counts as.
#[derive(Clone, Copy)]
struct Walk {
    steps: u32,
    cost: u32,
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Depth<'_, '_, I, V, T> {
    /// Reads the corners of a remembered sample's triangle.
    pub(super) fn load_corners(&self, parts: &mut Parts, row: usize) -> Result<(), QueryError> {
        let mut sample = parts.sample(row);
        if let (Fit::Remembered, Some(TriangleRow(row))) = (sample.fit, sample.triangle) {
            let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
            (sample.corners, sample.fit) = (self.corners(corners)?, Fit::Near);
        }
        parts.set_sample(row, sample);
        Ok(())
    }

    /// Moves a remembered sample's triangle to neighbours that are closer now.
    pub(super) fn walk(&mut self, parts: &mut Parts, row: usize) -> Result<(), QueryError> {
        let mut sample = parts.sample(row);
        if sample.fit < Fit::Closest {
            let walk = self.affordable();
            self.descend(&mut sample, 0.0, walk)?;
            parts.set_sample(row, sample);
        }
        Ok(())
    }

    /// Moves a sample's triangle to closer neighbours, until none is closer or the distance is within `enough`.
    fn descend(&mut self, sample: &mut Sample, enough: f32, walk: Walk) -> Result<(), QueryError> {
        let (mut least, mut distances) = (sample.square(sample.on_axis), 1);
        let mut before = None;
        for _ in 0..walk.steps {
            let Some(TriangleRow(from)) = sample.triangle.filter(|_| least > enough * enough)
            else {
                break;
            };
            let neighbours = (0..3).filter_map(|edge| self.tree.row_across(from, edge));
            for row in neighbours.filter(|&row| before != Some(row)) {
                let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
                let corners = self.corners(corners)?;
                let square = part::square(sample.on_axis, &corners);
                distances += 1;
                if square < least {
                    least = square;
                    (sample.triangle, sample.corners) = (Some(TriangleRow(row)), corners);
                }
            }
            if sample.triangle == Some(TriangleRow(from)) {
                break;
            }
            before = Some(from);
        }
        sample.fit = Fit::Closest;
        sample.depth = smaller(sqrt(least), sample.depth);
        self.spend(distances * walk.cost);
        Ok(())
    }

    /// As many steps as the budget covers twice, from either neighbour.
    fn affordable(&self) -> Walk {
        if !self.is_priced {
            return Walk { steps: STEPS, cost: DISTANCE_COST };
        }
        let cost = DISTANCE_COST + STEP;
        let affordable = self.options.budget.tests() / (2 * 3 * cost);
        Walk { steps: affordable.min(STEPS), cost }
    }

    /// A point of the axis between two samples, with a triangle found by steps from theirs, whose distance bounds the
    /// point's depth. The steps end once the depth is at most `enough`.
    pub(super) fn between(
        &mut self,
        along: f32,
        [near, far]: [&Sample; 2],
        enough: f32,
    ) -> Result<Sample, QueryError> {
        let parameter = along / self.tool.axis_length();
        let at = |this: &Self, end: &Sample| {
            this.at(parameter, end.depth + (along - end.along).abs(), end)
        };
        let mut closest = at(self, near);
        let walk = self.affordable();
        self.descend(&mut closest, enough, walk)?;
        if closest.depth > enough {
            let mut other = at(self, far);
            self.descend(&mut other, enough, walk)?;
            if other.depth < closest.depth {
                closest = other;
            }
        }
        Ok(closest)
    }
}

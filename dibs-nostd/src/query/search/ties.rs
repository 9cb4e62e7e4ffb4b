//! The triangles that may be the closest one, or share its closest point.
//!
//! A search finds one closest triangle, with an error. The true closest one, and all others that share its closest
//! point, are as close within [`TIE`], and no bound rejects them: the slack of the cutoff is larger. So a search
//! collects every triangle that it tests within that tolerance, and a tracker also those that it skips. They decide the
//! side.

// Requirement: S-01

use heapless::Vec;

use super::node::RANGE;
use super::slack::{ACCURACY, FLOOR, TIE};
use super::{Search, WaitingNode};
use crate::math::sqrt::sqrt;
use crate::query::made::Tests;
use crate::tool::Tool;
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// Most triangles kept. Usually about six share a vertex.
const MOST: usize = 32;

/// A triangle about as close as the closest.
#[derive(Clone, Copy, Debug)]
struct Tie {
    row: u32,
    /// Square of its distance, or of a lower bound.
    square: f32,
}

/// Triangles about as close as the closest.
#[derive(Clone, Debug)]
pub(in crate::query) struct Ties {
    rows: Vec<Tie, MOST>,
    /// Square of the distance up to which triangles are collected.
    limit: f32,
    /// Square of the distance up to which the axis may touch a triangle; negative if not needed.
    touching: f32,
    /// There were too many, or the search did not collect all.
    are_missing: bool,
    /// They are all the triangles that meet in one feature.
    are_star: bool,
}

impl Ties {
    pub const fn new() -> Self {
        let rows = Vec::new();
        Self { rows, limit: -1.0, touching: -1.0, are_missing: true, are_star: false }
    }

    /// An empty list for the triangles that meet in a feature.
    pub const fn star() -> Self {
        let rows = Vec::new();
        Self { rows, limit: -1.0, touching: -1.0, are_missing: false, are_star: true }
    }

    /// Adds a triangle that meets in the feature.
    pub fn add(&mut self, row: u32) {
        self.push(row, 0.0, 0.0);
    }

    /// Clears the list. `is_crossable` if the axis can touch the surface and the surface is closed.
    #[inline(always)]
    pub(super) fn reset(&mut self, scale: f32, is_crossable: bool) {
        let accuracy = ACCURACY * scale + FLOOR;
        self.touching = if is_crossable { accuracy * accuracy } else { -1.0 };
        self.rows.clear();
        self.limit = -1.0;
        (self.are_missing, self.are_star) = (false, false);
    }

    /// Keeps the triangles that satisfy a condition.
    pub fn keep(&mut self, is_kept: impl Fn(u32) -> bool) {
        for tie in &mut self.rows {
            if !is_kept(tie.row) {
                tie.square = f32::INFINITY;
            }
        }
    }

    /// Number of triangles kept.
    pub fn count(&self) -> u32 {
        self.rows.len() as u32
    }

    /// Whether triangles may be missing.
    pub const fn are_missing(&self) -> bool {
        self.are_missing
    }

    /// Notes that triangles may be missing.
    #[inline(always)]
    pub(super) const fn lose(&mut self) {
        self.are_missing = true;
    }

    /// Adds a triangle, if the limit is `limit`.
    #[inline(always)]
    pub(super) fn push(&mut self, row: u32, square: f32, limit: f32) {
        self.limit = limit;
        // Otherwise each of thousands of tied triangles would try to make room again.
        if self.are_missing {
            return;
        }
        if self.rows.is_full() {
            self.drop_farther();
        }
        self.are_missing = self.rows.push(Tie { row, square }).is_err();
    }

    /// Makes room by dropping triangles beyond the limit.
    #[cold]
    #[inline(never)]
    fn drop_farther(&mut self) {
        self.rows.retain(|tie| tie.square <= self.limit);
    }

    fn within(&self, limit: f32) -> impl Iterator<Item = u32> {
        self.rows.iter().filter(move |tie| tie.square <= limit).map(|tie| tie.row)
    }

    /// All triangles that may be the closest, or share its closest point. `None` if unknown.
    pub fn rows(&self) -> Option<impl Iterator<Item = u32>> {
        (!self.are_missing).then(|| self.within(self.limit))
    }

    /// The triangles that decide the side in f64: all. If too many meet in one feature, the first, since each
    /// represents the feature.
    pub fn deciding(&self) -> Option<impl Iterator<Item = u32>> {
        let most = if self.are_missing { usize::from(self.are_star) } else { MOST };
        (most > 0).then(|| self.within(self.limit).take(most))
    }

    /// Whether the triangles that the axis may touch are known.
    pub fn has_touched(&self) -> bool {
        !self.are_missing && self.touching >= 0.0
    }

    /// The first triangle at or after an index that the axis may touch, with its index. A loop over an iterator takes
    /// three times the code.
    pub fn touched_from(&self, from: usize) -> Option<(usize, u32)> {
        let mut rest = self.rows.iter().enumerate().skip(from);
        rest.find(|(_, tie)| tie.square <= self.touching).map(|(at, tie)| (at, tie.row))
    }
}

/// The square of the distance up to which triangles tie with the closest, at `distance`.
#[inline(always)]
pub(super) fn limit_of(distance: f32, scale: f32) -> f32 {
    let limit = distance + (TIE * scale + FLOOR);
    limit * limit
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Visits every triangle that may be the closest, or share its closest point, for a search that started at the
    /// closest one. A visit returns whether to continue. Returns whether all were visited, and the tests made.
    #[cold]
    #[inline(never)]
    pub fn each_tie(
        mut self,
        mut visit: impl FnMut(u32) -> Result<bool, QueryError>,
    ) -> Result<(bool, Tests), QueryError> {
        let limit = limit_of(sqrt(self.best_squared), self.scale);
        while let Some(WaitingNode { lower, link }) = self.pop() {
            if lower > self.cutoff {
                continue;
            }
            let link = NodeLink::decode(link);
            let (NodeLink::Children { first, count } | NodeLink::Leaf { first, count }) = link;
            if self.meter.nodes(count).is_none() {
                return Ok((false, self.meter.made()));
            }
            if let NodeLink::Children { .. } = link {
                self.expand::<RANGE>(lower, first, count, 0.0)?;
                continue;
            }
            for triangle in first..first.saturating_add(count) {
                if self.meter.triangle().is_none() {
                    return Ok((false, self.meter.made()));
                }
                let corners = self.corners(triangle)?;
                let pair = self.tool.closest_on_triangle(&corners, self.cutoff_squared);
                if pair.is_some_and(|pair| pair.distance_squared <= limit) && !visit(triangle)? {
                    return Ok((false, self.meter.made()));
                }
            }
        }
        Ok((true, self.meter.made()))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::{MOST, Ties};

    fn rows(ties: &Ties) -> Option<Vec<u32>> {
        ties.rows().map(Iterator::collect)
    }

    fn touched(ties: &Ties) -> Option<Vec<u32>> {
        let mut next_at = 0;
        let next = || {
            let (at, row) = ties.touched_from(next_at)?;
            next_at = at + 1;
            Some(row)
        };
        ties.has_touched().then(|| std::iter::from_fn(next).collect())
    }

    #[test]
    fn rows_are_known_unless_too_many_are_as_close() {
        let mut ties = Ties::new();
        assert!(rows(&ties).is_none() && touched(&ties).is_none());
        ties.reset(1.0, true);
        for row in 0..MOST as u32 {
            ties.push(row, 0.0, 1.0);
        }
        let all: Vec<_> = (0..MOST as u32).collect();
        assert_eq!(rows(&ties), Some(all.clone()));
        assert_eq!(touched(&ties), Some(all));
        ties.push(99, 1.0, 1.0);
        assert!(rows(&ties).is_none() && touched(&ties).is_none());
        ties.reset(1.0, false);
        assert_eq!(rows(&ties), Some(Vec::new()));
        assert!(touched(&ties).is_none());
        ties.lose();
        assert_eq!(rows(&ties), None);
    }

    #[test]
    fn farther_ones_make_room() {
        let mut ties = Ties::new();
        ties.reset(1.0, true);
        for row in 0..MOST as u32 {
            ties.push(row, 1.0 + f32::from(u8::from(row % 2 == 0)), 2.0);
        }
        for row in 100..100 + MOST as u32 / 2 {
            ties.push(row, 1.0, 1.0);
        }
        let odd = (0..MOST as u32).filter(|row| row % 2 == 1);
        let all: Vec<_> = odd.chain(100..100 + MOST as u32 / 2).collect();
        assert_eq!(rows(&ties), Some(all));
        ties.push(7, 0.5, 0.5);
        assert_eq!(rows(&ties), Some(std::vec![7]));
        assert_eq!(touched(&ties), Some(Vec::new()));
    }
}

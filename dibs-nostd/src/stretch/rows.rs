//! The check of many triangles, row by row: where the time of a measurement goes.
//!
//! What a fan's triangles share is carried from one to the next. What an edge leaves of the largest square so
//! far, `L r - g` for its squares at rest and now, is the same number for both of its triangles, but in a tree
//! that is not `UNIFORM`: there triangles have limits of their own, and `r` is not the same for both.

use core::ops::Range;

use glam::Vec3;

use super::StretchError;
use super::kernel::{
    Edges, LongestEdge, Measure, SingularValue, Worst, root_up, squared_limit, squared_stretch,
};
use crate::format::{METRIC_BYTES, PathKind, metric_row};
use crate::{Index, Tree, VertexTable, format};

/// Checks the triangles of `rows`, as far as all their corners are below row `ready`, and raises `worst`
/// where one is stretched more. Returns the row to go on with.
pub(super) fn scan<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    surface: &V,
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
) -> Result<u32, StretchError> {
    match (tree.paths(), I::BYTES) {
        (PathKind::Surface, 2) => run::<I, V, SingularValue, 6>(tree, surface, rows, ready, worst),
        (PathKind::Surface, _) => run::<I, V, SingularValue, 12>(tree, surface, rows, ready, worst),
        (PathKind::EdgePath, 2) => run::<I, V, LongestEdge, 6>(tree, surface, rows, ready, worst),
        (PathKind::EdgePath, _) => run::<I, V, LongestEdge, 12>(tree, surface, rows, ready, worst),
    }
}

/// The run for one measure and `CORNERS` bytes a triangle: as far as [`measure`] comes, and why it comes no
/// farther.
fn run<I: Index, V: VertexTable + ?Sized, M: Measure, const CORNERS: usize>(
    tree: &Tree<'_, I>,
    surface: &V,
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
) -> Result<u32, StretchError> {
    let range = rows.start as usize..rows.end as usize;
    let (metrics, _) = tree.sections().metric.as_chunks::<METRIC_BYTES>();
    let (triangles, _) = tree.sections().triangles.as_chunks::<CORNERS>();
    let (Some(metrics), Some(triangles)) = (metrics.get(range.clone()), triangles.get(range))
    else {
        return Err(StretchError::Corrupt { row: rows.start });
    };
    let limit = squared_limit(tree.stretch());
    let (first, largest) = (rows.start, *worst);
    let row;
    (row, *worst) = if tree.sections().limits.is_empty() {
        measure::<I, V, M, CORNERS, true>(surface, metrics, triangles, ready, limit, first, largest)
    } else {
        measure::<I, V, M, CORNERS, false>(
            surface, metrics, triangles, ready, limit, first, largest,
        )
    };
    let measured = row.saturating_sub(first) as usize;
    let stopped_at = (metrics.get(measured), triangles.get(measured));
    let (Some(metric), Some(corners)) = stopped_at else { return Ok(row) };
    let Some(now) = edges::<I, V>(surface, corners, ready)? else { return Ok(row) };
    let (rest, _) = metric_row(metric);
    Err(exceeded(tree, row, squared_stretch::<M>(&rest, now, limit)))
}

/// What the next triangle of a fan has at hand.
#[derive(Clone, Copy)]
struct Fan {
    centre: Vec3,
    /// The edge that it shares with the triangle before.
    first: Vec3,
    /// What that leaves of the largest square so far.
    left: f32,
}

/// Measures triangles, the first of them in row `first`, up to one that has a corner at row `ready` or beyond,
/// or that is not certainly within `limit`. Returns its row.
#[inline(never)]
fn measure<
    I: Index,
    V: VertexTable + ?Sized,
    M: Measure,
    const CORNERS: usize,
    const UNIFORM: bool,
>(
    surface: &V,
    metrics: &[[u8; METRIC_BYTES]],
    triangles: &[[u8; CORNERS]],
    ready: u32,
    limit: f32,
    first: u32,
    mut worst: Worst,
) -> (u32, Worst) {
    // One comparison does for both.
    let vertices = surface.len() as u32;
    let ready = if ready < vertices { ready } else { vertices };
    let table = Table { surface, ready, limit };
    let mut row = first;
    // Of the triangle before the first nothing is known.
    let (Some(metric), Some(corners)) = (metrics.first(), triangles.first()) else {
        return (row, worst);
    };
    let ([rest, ..], _) = metric_row(metric);
    let Some(mut fan) = table.start::<I, CORNERS>(rest, corners, worst.squared) else {
        return (row, worst);
    };
    if !(fan.left > 0.0) {
        // Not within the largest so far. What is not a number passes nothing: a closer look is taken.
        fan.first = Vec3::NAN;
    }
    // Two at a time, so that what one leaves to the next takes no moves.
    let (pairs, last_metric) = metrics.as_chunks::<2>();
    let (pairs_of_corners, last_corners) = triangles.as_chunks::<2>();
    for ([m0, m1], [t0, t1]) in pairs.iter().zip(pairs_of_corners) {
        let next = table.next::<I, M, CORNERS, UNIFORM>(fan, m0, t0, row, &mut worst);
        let Some(next) = next else { return (row, worst) };
        let next =
            table.next::<I, M, CORNERS, UNIFORM>(next, m1, t1, row.wrapping_add(1), &mut worst);
        let Some(next) = next else { return (row.wrapping_add(1), worst) };
        fan = next;
        row = row.wrapping_add(2);
    }
    for (metric, corners) in last_metric.iter().zip(last_corners) {
        let next = table.next::<I, M, CORNERS, UNIFORM>(fan, metric, corners, row, &mut worst);
        let Some(next) = next else { break };
        fan = next;
        row = row.wrapping_add(1);
    }
    (row, worst)
}

/// What triangles are measured on: vertices below row `ready`, none of them beyond `limit`, a square.
struct Table<'a, V: ?Sized> {
    surface: &'a V,
    ready: u32,
    limit: f32,
}

impl<V: VertexTable + ?Sized> Table<'_, V> {
    /// Measures one triangle.
    #[inline(always)]
    fn next<I: Index, M: Measure, const CORNERS: usize, const UNIFORM: bool>(
        &self,
        fan: Fan,
        metric: &[u8; METRIC_BYTES],
        corners: &[u8; CORNERS],
        row: u32,
        worst: &mut Worst,
    ) -> Option<Fan> {
        match self.pass::<I, M, CORNERS, UNIFORM>(fan, metric, corners, worst.squared) {
            Some(next) => Some(next),
            None => {
                let (next, raised) =
                    self.look_closer::<I, M, CORNERS>(metric, corners, row, *worst)?;
                *worst = raised;
                Some(next)
            }
        }
    }

    /// The first two corners.
    #[inline(always)]
    fn start<I: Index, const CORNERS: usize>(
        &self,
        rest: f32,
        corners: &[u8; CORNERS],
        largest: f32,
    ) -> Option<Fan> {
        let centre = self.corner::<I, CORNERS>(corners, 0)?;
        let first = self.corner::<I, CORNERS>(corners, 1)? - centre;
        Some(Fan { centre, first, left: largest * rest - first.length_squared() })
    }

    /// Checks that a triangle is certainly not stretched beyond `sqrt(largest)`. What is not likely is left to
    /// others.
    #[inline(always)]
    fn pass<I: Index, M: Measure, const CORNERS: usize, const UNIFORM: bool>(
        &self,
        mut fan: Fan,
        metric: &[u8; METRIC_BYTES],
        corners: &[u8; CORNERS],
        largest: f32,
    ) -> Option<Fan> {
        let ([rest_first, ..], continues) = metric_row(metric);
        if !continues {
            fan = self.start::<I, CORNERS>(rest_first, corners, largest)?;
        } else if !UNIFORM {
            fan.left = largest * rest_first - fan.first.length_squared();
        }
        if (!continues || !UNIFORM) && !(fan.left > 0.0) {
            return None;
        }
        let second = self.corner::<I, CORNERS>(corners, 2)? - fan.centre;
        // Read here, not above: so few registers are in use at a time that none has to be put aside.
        let ([_, rest_between, rest_second], _) = metric_row(metric);
        let left = largest * rest_second - second.length_squared();
        let now = Edges { first: fan.first, second };
        let is_within = M::is_within(fan.left, left, largest * rest_between, now);
        is_within.then_some(Fan { centre: fan.centre, first: second, left })
    }

    /// Raises `worst` if a triangle is stretched more; `None` beyond the limit.
    #[cold]
    #[inline(never)]
    fn look_closer<I: Index, M: Measure, const CORNERS: usize>(
        &self,
        metric: &[u8; METRIC_BYTES],
        corners: &[u8; CORNERS],
        row: u32,
        mut worst: Worst,
    ) -> Option<(Fan, Worst)> {
        let centre = self.corner::<I, CORNERS>(corners, 0)?;
        let first = self.corner::<I, CORNERS>(corners, 1)? - centre;
        let second = self.corner::<I, CORNERS>(corners, 2)? - centre;
        let (rest, _) = metric_row(metric);
        let squared = squared_stretch::<M>(&rest, Edges { first, second }, self.limit);
        if !(squared <= self.limit) {
            return None;
        }
        if squared > worst.squared {
            worst = Worst { squared, triangle: row };
        }
        let [.., rest_second] = rest;
        let left = worst.squared * rest_second - second.length_squared();
        // It is within the largest now: below 0 is rounding.
        let left = if left > 0.0 { left } else { 0.0 };
        Some((Fan { centre, first: second, left }, worst))
    }

    /// Position of a triangle's corner, if it is there.
    #[inline(always)]
    fn corner<I: Index, const CORNERS: usize>(
        &self,
        corners: &[u8; CORNERS],
        number: u32,
    ) -> Option<Vec3> {
        let row = format::vertex_number::<I>(corners, number)?;
        if row < self.ready { self.surface.position(row) } else { None }
    }
}

/// A triangle's edges; `None` while a corner is not below row `ready`.
fn edges<I: Index, V: VertexTable + ?Sized>(
    surface: &V,
    corners: &[u8],
    ready: u32,
) -> Result<Option<Edges>, StretchError> {
    let mut positions = [Vec3::ZERO; 3];
    for (number, position) in (0..).zip(&mut positions) {
        let row = format::vertex_number::<I>(corners, number).unwrap_or(u32::MAX);
        if row >= ready && (row as usize) < surface.len() {
            return Ok(None);
        }
        *position = surface.position(row).ok_or(StretchError::Corrupt { row })?;
    }
    let [centre, first, second] = positions;
    Ok(Some(Edges { first: first - centre, second: second - centre }))
}

/// Names a triangle beyond its limit, both in terms of its rest shape.
#[cold]
fn exceeded<I: Index>(tree: &Tree<'_, I>, triangle: u32, squared: f32) -> StretchError {
    let limit = tree.stretch_limit(triangle).unwrap_or(tree.stretch());
    let stretch = root_up(squared) * (limit / tree.stretch());
    StretchError::Exceeded { triangle, stretch, limit }
}

//! The check of many triangles, row by row: the hot loop of a measurement.
//!
//! Corners shared with the previous triangle are carried over ([`Join`]). So is an edge's slack under the largest
//! square `L` so far: `L r - g`, with the squared length `r` at rest and `g` now. Both triangles of the edge have the
//! same `r`, unless each triangle has its own limit (a tree that is not `UNIFORM`).
//!
//! One file, because the compiler inlines the loop as a whole.

// Requirement: F-02

mod batched;

use core::ops::Range;

use glam::Vec3;

use super::StretchError;
use super::kernel::{
    Edges, LongestEdge, Measure, SingularValue, Worst, root_up, squared_limit, squared_stretch,
};
use crate::math::order::larger;
use crate::surface::VertexTable;
use crate::tree::format::{Join, METRIC_BYTES, Metric, PathKind, metric_row};
use crate::tree::{Index, Tree, TriangleRow, format};

/// Whether the processor has vector registers and loads unaligned words. Elsewhere four triangles at a time take more
/// instructions, not fewer.
const WIDE: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

/// Checks the triangles of `rows` up to the first with a corner at row `ready` or beyond. Raises `worst` at a triangle
/// stretched more, and adds the square of one edge of each triangle to `size`. Returns the next row to check.
pub(super) fn scan<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    surface: &V,
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
    size: &mut f32,
) -> Result<u32, StretchError> {
    match tree.paths() {
        PathKind::Surface => run::<I, V, SingularValue>(tree, surface, rows, ready, worst, size),
        PathKind::EdgePath => run::<I, V, LongestEdge>(tree, surface, rows, ready, worst, size),
        // For this kind elements are measured, not triangles.
        PathKind::Volume => Err(StretchError::NoMetric),
    }
}

/// Raises `worst` if one triangle is stretched more and all its corners are below row `ready`. Returns whether they
/// are. Triangles beyond their limit are left to [`scan`].
pub(super) fn check<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    surface: &V,
    row: u32,
    ready: u32,
    worst: &mut Worst,
) -> bool {
    let Some(metric) = tree.metric(row) else { return true };
    let now = match edges(tree, surface, row, &metric, ready) {
        Ok(Some(now)) => now,
        Ok(None) => return false,
        Err(_) => return true,
    };
    let limit = squared_limit(tree.stretch());
    let squared = match tree.paths() {
        PathKind::Surface => squared_stretch::<SingularValue>(&metric.squares, now, limit),
        PathKind::EdgePath => squared_stretch::<LongestEdge>(&metric.squares, now, limit),
        PathKind::Volume => return true,
    };
    if squared > worst.squared && squared <= limit {
        *worst = Worst { squared, triangle: row };
    }
    true
}

/// [`scan`] for one measure: [`measure`], then the reason for an early end.
fn run<I: Index, V: VertexTable + ?Sized, M: Measure>(
    tree: &Tree<'_, I>,
    surface: &V,
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
    size: &mut f32,
) -> Result<u32, StretchError> {
    let triangles = I::corners(tree.sections().triangles);
    let bytes = tree.sections().metric;
    // Aligned words take fewer instructions than bytes, unless the processor loads unaligned words as fast.
    let row = match bytemuck::try_cast_slice::<u8, u32>(bytes) {
        Ok(words) if !WIDE => {
            let (metrics, _) = words.as_chunks();
            run_on::<I, V, M, [u32; 3]>(
                tree,
                surface,
                metrics,
                triangles,
                rows.clone(),
                ready,
                worst,
                size,
            )
        }
        _ => {
            let (metrics, _) = bytes.as_chunks();
            run_on::<I, V, M, [u8; METRIC_BYTES]>(
                tree,
                surface,
                metrics,
                triangles,
                rows.clone(),
                ready,
                worst,
                size,
            )
        }
    };
    let row = row.ok_or(StretchError::Corrupt { row: rows.start })?;
    if row >= rows.end {
        return Ok(row);
    }
    let metric = tree.metric(row).ok_or(StretchError::Corrupt { row })?;
    let Some(now) = edges(tree, surface, row, &metric, ready)? else { return Ok(row) };
    let limit = squared_limit(tree.stretch());
    Err(exceeded(tree, row, squared_stretch::<M>(&metric.squares, now, limit)))
}

/// [`measure`] on undecoded rows of the metric section; `None` if there are none.
#[expect(
    clippy::too_many_arguments,
    reason = "arguments stay in registers, fields of a struct do not"
)]
fn run_on<I: Index, V: VertexTable + ?Sized, M: Measure, R: MetricBits>(
    tree: &Tree<'_, I>,
    surface: &V,
    metrics: &[R],
    triangles: &[I::Corners],
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
    size: &mut f32,
) -> Option<u32> {
    let range = rows.start as usize..rows.end as usize;
    let (metrics, triangles) = (metrics.get(range.clone())?, triangles.get(range)?);
    let limit = squared_limit(tree.stretch());
    let (first, largest, sum) = (rows.start, *worst, *size);
    if WIDE && tree.sections().limits.is_empty() && ready as usize >= surface.len() {
        let row;
        (row, *worst, *size) =
            batched::measure::<I, V, M, R>(surface, metrics, triangles, limit, first, largest, sum);
        return Some(row);
    }
    let row;
    (row, *worst, *size) = if tree.sections().limits.is_empty() {
        measure::<I, V, M, R, true>(surface, metrics, triangles, ready, limit, first, largest, sum)
    } else {
        measure::<I, V, M, R, false>(surface, metrics, triangles, ready, limit, first, largest, sum)
    };
    Some(row)
}

/// An undecoded row of the metric section.
trait MetricBits {
    fn bits(&self) -> [u32; 3];
}

impl MetricBits for [u32; 3] {
    #[inline(always)]
    fn bits(&self) -> [u32; 3] {
        let &[first, between, second] = self;
        [u32::from_le(first), u32::from_le(between), u32::from_le(second)]
    }
}

impl MetricBits for [u8; METRIC_BYTES] {
    #[inline(always)]
    fn bits(&self) -> [u32; 3] {
        let [first, between, second] = metric_row(self);
        [first.to_bits(), between.to_bits(), second.to_bits()]
    }
}

/// The state passed from one triangle to the next.
#[derive(Clone, Copy)]
struct PreviousTriangle {
    centre: Vec3,
    third: Vec3,
    /// The edge from the centre to the third corner.
    edge: Vec3,
    /// The edge's slack under the largest square so far.
    left: f32,
    square: f32,
}

/// Measures triangles, starting in row `first`, up to one with a corner at row `ready` or beyond, or not certainly
/// within `limit`. Returns its row.
#[inline(never)]
#[expect(
    clippy::too_many_arguments,
    reason = "arguments stay in registers, fields of a struct do not"
)]
fn measure<I: Index, V: VertexTable + ?Sized, M: Measure, R: MetricBits, const UNIFORM: bool>(
    surface: &V,
    metrics: &[R],
    triangles: &[I::Corners],
    ready: u32,
    limit: f32,
    first: u32,
    mut worst: Worst,
    mut size: f32,
) -> (u32, Worst, f32) {
    // One comparison checks both bounds.
    let vertices = surface.len() as u32;
    let ready = if ready < vertices { ready } else { vertices };
    let table = Table { surface, ready, limit };
    let mut row = first;
    let (Some(metric), Some(corners)) = (metrics.first(), triangles.first()) else {
        return (row, worst, size);
    };
    let Some(mut before) = table.before::<I>(metric, corners, worst.squared) else {
        return (row, worst, size);
    };
    // Two at a time, which saves moves of the state between them.
    let (pairs, last_metric) = metrics.as_chunks::<2>();
    let (pairs_of_corners, last_corners) = triangles.as_chunks::<2>();
    for ([m0, m1], [t0, t1]) in pairs.iter().zip(pairs_of_corners) {
        let next = table.next::<I, M, UNIFORM>(before, m0, t0, row, &mut worst);
        let Some(next) = next else { return (row, worst, size) };
        size += next.square;
        let next = table.next::<I, M, UNIFORM>(next, m1, t1, row.wrapping_add(1), &mut worst);
        let Some(next) = next else { return (row.wrapping_add(1), worst, size) };
        size += next.square;
        before = next;
        row = row.wrapping_add(2);
    }
    for (metric, corners) in last_metric.iter().zip(last_corners) {
        let next = table.next::<I, M, UNIFORM>(before, metric, corners, row, &mut worst);
        let Some(next) = next else { break };
        size += next.square;
        before = next;
        row = row.wrapping_add(1);
    }
    (row, worst, size)
}

/// The surface to measure: vertices below row `ready`, triangles up to `limit` (a square).
struct Table<'a, V: ?Sized> {
    surface: &'a V,
    ready: u32,
    limit: f32,
}

impl<V: VertexTable + ?Sized> Table<'_, V> {
    /// The state before the first triangle of a range, from that triangle's first two corners.
    #[inline(always)]
    fn before<I: Index>(
        &self,
        metric: &impl MetricBits,
        corners: &I::Corners,
        largest: f32,
    ) -> Option<PreviousTriangle> {
        let metric = Metric::new(metric.bits().map(f32::from_bits));
        let (a, b) = (self.corner::<I>(corners, 0)?, self.corner::<I>(corners, 1)?);
        let [centre, other, _] = metric.centre_first([a, b, b]);
        let edge = if metric.join == Join::Flip { centre - other } else { other - centre };
        let [rest, ..] = metric.squares;
        let left = largest * rest - edge.length_squared();
        // NaN fails the quick check, so that the triangle is measured.
        let edge = if left > 0.0 { edge } else { Vec3::NAN };
        Some(PreviousTriangle { centre, third: centre, edge, left, square: 0.0 })
    }

    /// Measures one triangle.
    #[inline(always)]
    fn next<I: Index, M: Measure, const UNIFORM: bool>(
        &self,
        before: PreviousTriangle,
        metric: &impl MetricBits,
        corners: &I::Corners,
        row: u32,
        worst: &mut Worst,
    ) -> Option<PreviousTriangle> {
        match self.pass::<I, M, UNIFORM>(before, metric, corners, worst.squared) {
            Some(next) => Some(next),
            None => {
                let (next, raised) = self.measure_triangle::<I, M>(metric, corners, row, *worst)?;
                *worst = raised;
                Some(next)
            }
        }
    }

    /// Checks that a triangle is certainly not stretched beyond `sqrt(largest)`. Rare cases fall through to
    /// `measure_triangle`.
    #[inline(always)]
    fn pass<I: Index, M: Measure, const UNIFORM: bool>(
        &self,
        before: PreviousTriangle,
        metric: &impl MetricBits,
        corners: &I::Corners,
        largest: f32,
    ) -> Option<PreviousTriangle> {
        let PreviousTriangle { mut centre, third, edge: mut first, mut left, .. } = before;
        let [mark, between, second] = metric.bits();
        let (rest_between, rest_second) = (f32::from_bits(between), f32::from_bits(second));
        // The codes of `Join`, the most frequent first: written out, since a match would make an enum of them.
        if mark as i32 >= 0 {
            if mark & 1 == 0 {
                let [a, b] = self.first_two::<I>(corners)?;
                (centre, first) = (a, b - a);
                left = largest * f32::from_bits(mark) - first.length_squared();
                if !(left > 0.0) {
                    return None;
                }
            } else {
                // `cold_path` and `+ ZERO` make the compiler move positions on the flip path, not the fan path. (A zero
                // may lose its sign, which does not change its square.)
                core::hint::cold_path();
                centre = third + Vec3::ZERO;
                first = -first;
            }
        }
        if !UNIFORM {
            left = largest * f32::from_bits(mark).abs() - first.length_squared();
            if !(left > 0.0) {
                return None;
            }
        }
        let third = self.corner::<I>(corners, 2)?;
        let edge = third - centre;
        let square = edge.length_squared();
        let left_second = largest * rest_second - square;
        let now = Edges { first, second: edge };
        let is_within = M::is_within(left, left_second, largest * rest_between, now);
        is_within.then_some(PreviousTriangle { centre, third, edge, left: left_second, square })
    }

    /// Raises `worst` if a triangle is stretched more; `None` beyond the limit.
    #[cold]
    #[inline(never)]
    fn measure_triangle<I: Index, M: Measure>(
        &self,
        metric: &impl MetricBits,
        corners: &I::Corners,
        row: u32,
        mut worst: Worst,
    ) -> Option<(PreviousTriangle, Worst)> {
        let metric = Metric::new(metric.bits().map(f32::from_bits));
        let a = self.corner::<I>(corners, 0)?;
        let b = self.corner::<I>(corners, 1)?;
        let third = self.corner::<I>(corners, 2)?;
        let [centre, other, _] = metric.centre_first([a, b, third]);
        let now = Edges { first: other - centre, second: third - centre };
        let squared = squared_stretch::<M>(&metric.squares, now, self.limit);
        if !(squared <= self.limit) {
            return None;
        }
        if squared > worst.squared {
            worst = Worst { squared, triangle: row };
        }
        let [.., rest_second] = metric.squares;
        let square = now.second.length_squared();
        let left = worst.squared * rest_second - square;
        // The triangle is now within the largest square, so a value below 0 is rounding.
        let left = larger(0.0, left);
        Some((PreviousTriangle { centre, third, edge: now.second, left, square }, worst))
    }

    /// Positions of a triangle's first two corners; `None` unless both rows are below `ready`.
    #[inline(always)]
    fn first_two<I: Index>(&self, corners: &I::Corners) -> Option<[Vec3; 2]> {
        let a = format::vertex_number::<I>(corners.as_ref(), 0)?;
        let b = format::vertex_number::<I>(corners.as_ref(), 1)?;
        // `&`, not `&&`: one branch for both.
        if (a < self.ready) & (b < self.ready) {
            Some([self.surface.position(a)?, self.surface.position(b)?])
        } else {
            None
        }
    }

    /// Position of a triangle's corner; `None` unless its row is below `ready`.
    #[inline(always)]
    fn corner<I: Index>(&self, corners: &I::Corners, number: u32) -> Option<Vec3> {
        let row = format::vertex_number::<I>(corners.as_ref(), number)?;
        if row < self.ready { self.surface.position(row) } else { None }
    }
}

/// A triangle's edges; `None` if a corner is not below row `ready`.
fn edges<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    surface: &V,
    row: u32,
    metric: &Metric,
    ready: u32,
) -> Result<Option<Edges>, StretchError> {
    let corners = tree.triangle(row).ok_or(StretchError::Corrupt { row })?;
    let mut positions = [Vec3::ZERO; 3];
    for (row, position) in corners.into_iter().zip(&mut positions) {
        if row >= ready && (row as usize) < surface.len() {
            return Ok(None);
        }
        *position = surface.position(row).ok_or(StretchError::Corrupt { row })?;
    }
    let [centre, first, second] = metric.centre_first(positions);
    Ok(Some(Edges { first: first - centre, second: second - centre }))
}

/// The error for a triangle beyond its limit, with its stretch and limit relative to its rest shape.
#[cold]
fn exceeded<I: Index>(tree: &Tree<'_, I>, row: u32, squared: f32) -> StretchError {
    let triangle = TriangleRow(row);
    let limit = tree.stretch_limit(triangle).unwrap_or(tree.stretch());
    let stretch = root_up(squared) * (limit / tree.stretch());
    StretchError::Exceeded { triangle, stretch, limit }
}

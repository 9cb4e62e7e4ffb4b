//! The check of one triangle, and the run over rows of them.
//!
//! Let `f1` and `f2` lead from a triangle's first corner to its second and third, as they are now, and
//! `G` be their Gram matrix, `[f1.f1, f1.f2; f1.f2, f2.f2]`; `M` is the same at rest, from the tree's
//! metric section. The triangle's largest singular value is at most `sigma` exactly if `L M - G` is
//! positive semidefinite for `L = sigma^2`: if its diagonal and its determinant are not negative. So
//! against the largest `L` so far a triangle takes neither a root nor a division. Only one that
//! fails has its own value worked out, and whatever that gives counts only once it passes the same check.
//!
//! # Rounding
//!
//! Let `u = 2^-24`. The entries of `G` come from differences of coordinates: the diagonal's are off by
//! at most `5 u` of themselves, the other by `5 u |f1| |f2|`. A difference `x = L a - g` takes two more
//! roundings, the comparison of the products two. If it holds, then, with `a` and `d` the diagonal of
//! `M`, `G` is below `L (M + E)` with `|E11| <= 6.1 u a`, `|E22| <= 6.1 u d` and `|E12| <= 12.1 u sqrt(a d)`,
//! so below `L (M + 18.2 u diag(a, d))`. Storing the off-diagonal entry of `M` takes `u sqrt(a d)`. And
//! `diag(a, d)` is below `M / (1 - |cos|)`, `cos` that of the angle at the first corner. So the builder
//! divides `M` by `1 + 20 u / (1 - |cos|)`, rounding down, and what passes is not stretched beyond
//! `sqrt(L)`. It chooses the first corner so that this is little. For edges 6.1 u is all.
//!
//! The builder keeps products away from overflow and from underflow; where it cannot it stores a
//! metric of zeros, which nothing passes.

use core::ops::Range;

use glam::Vec3;

use super::StretchError;
use crate::format::{METRIC_BYTES, PathKind};
use crate::sqrt::sqrt;
use crate::{Index, Tree, VertexTable, format};

/// Half a unit in the last place of 1.
pub(super) const U: f32 = 1.0 / 16_777_216.0;

/// What no measurement goes below: the square of a half. A surface that shrank more than that is
/// searched no faster, and products stay away from underflow.
pub(super) const LEAST: f32 = 0.25;

/// The largest squared stretch so far, as a part of each triangle's own limit, and whose it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Worst {
    pub squared: f32,
    pub triangle: u32,
}

impl Worst {
    pub const fn none(triangle: u32) -> Self {
        Self { squared: LEAST, triangle }
    }
}

/// Squares that a triangle is judged by: now, or at rest.
type Squares = [f32; 3];

/// A triangle as it is now: the edges from its first corner to the second and to the third.
#[derive(Clone, Copy)]
struct Edges {
    first: Vec3,
    second: Vec3,
}

/// What a path kind measures.
trait Measure {
    /// The squares of a triangle as it is now.
    fn squares(now: Edges) -> Squares;

    /// Whether the stretch is certainly at most `sqrt(limit)`. False for what is not a number.
    fn within(rest: &Squares, now: &Squares, limit: f32) -> bool;

    /// About the square of the stretch.
    fn estimate(rest: &Squares, now: &Squares) -> f32;

    /// The same as [`within`](Self::within), of what is left of the limit: `first` by the first edge, known
    /// to be positive, and `second` by the second one; `between` is the limit times the rest square.
    /// Where it is true, `second` is positive.
    fn is_within(first: f32, second: f32, between: f32, now: Edges) -> bool;
}

/// The largest singular value.
struct SingularValue;

impl Measure for SingularValue {
    #[inline(always)]
    fn squares(Edges { first, second }: Edges) -> Squares {
        [first.length_squared(), first.dot(second), second.length_squared()]
    }

    #[inline(always)]
    fn within(&[a, h, d]: &Squares, &[g11, g12, g22]: &Squares, limit: f32) -> bool {
        let (x, y, z) = (limit * a - g11, limit * h - g12, limit * d - g22);
        // Both are needed: a determinant is positive, too, where both eigenvalues are negative.
        x * z >= y * y && x > 0.0
    }

    /// By `F^T F` in an orthonormal frame of the rest triangle.
    fn estimate(&[a, h, d]: &Squares, &[g11, g12, g22]: &Squares) -> f32 {
        let along = h / a;
        let height = d - along * h;
        let pp = g11 / a;
        let qq = (g22 - 2.0 * along * g12 + along * along * g11) / height;
        let pq = (g12 - along * g11) / sqrt(a * height);
        let (mean, half) = (0.5 * (pp + qq), 0.5 * (pp - qq));
        mean + sqrt(half * half + pq * pq)
    }

    /// What is above a square is positive, and with `first` so is `second`.
    #[inline(always)]
    fn is_within(first: f32, second: f32, between: f32, now: Edges) -> bool {
        let between = between - now.first.dot(now.second);
        first * second > between * between
    }
}

/// The longest of the three edges, each against its rest length.
struct LongestEdge;

impl Measure for LongestEdge {
    #[inline(always)]
    fn squares(Edges { first, second }: Edges) -> Squares {
        [first.length_squared(), (second - first).length_squared(), second.length_squared()]
    }

    #[inline(always)]
    fn within(&[a, h, d]: &Squares, &[g1, g2, g3]: &Squares, limit: f32) -> bool {
        limit * a >= g1 && limit * h >= g2 && limit * d >= g3
    }

    fn estimate(rest: &Squares, now: &Squares) -> f32 {
        let mut worst = 0.0;
        for (rest, now) in rest.iter().zip(now) {
            let ratio = now / rest;
            // Written so that what is not a number stays.
            if !(ratio <= worst) {
                worst = ratio;
            }
        }
        worst
    }

    #[inline(always)]
    fn is_within(_: f32, second: f32, between: f32, now: Edges) -> bool {
        second > 0.0 && between >= (now.second - now.first).length_squared()
    }
}

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

/// The run for one measure and `CORNERS` bytes a triangle: past what [`passing`] lets pass, with a closer
/// look at what it does not.
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
    let (Some(mut metrics), Some(mut triangles)) =
        (metrics.get(range.clone()), triangles.get(range))
    else {
        return Err(StretchError::Corrupt { row: rows.start });
    };
    let is_uniform = tree.sections().limits.is_empty();
    let mut row = rows.start;
    // Every turn takes a triangle.
    for _ in rows {
        let passed = if is_uniform {
            passing::<I, V, M, CORNERS, true>(surface, metrics, triangles, ready, worst.squared)
        } else {
            passing::<I, V, M, CORNERS, false>(surface, metrics, triangles, ready, worst.squared)
        };
        row = row.saturating_add(passed as u32);
        let (Some([metric, metrics_after @ ..]), Some([corners, triangles_after @ ..])) =
            (metrics.get(passed..), triangles.get(passed..))
        else {
            break;
        };
        let Some(now) = edges::<I, V>(surface, corners, ready)? else { break };
        let (rest, now) = (format::metric_row(metric), M::squares(now));
        if !M::within(&rest, &now, worst.squared) {
            match squared_stretch::<M>(&rest, &now, squared_limit(tree.stretch())) {
                Ok(squared) if squared > worst.squared => *worst = Worst { squared, triangle: row },
                Ok(_) => (),
                Err(squared) => return Err(exceeded(tree, row, squared)),
            }
        }
        row = row.saturating_add(1);
        (metrics, triangles) = (metrics_after, triangles_after);
    }
    Ok(row)
}

/// How many of the first triangles have all their corners below row `ready` and certainly are not stretched
/// beyond `sqrt(limit)`. The next one may be fine, too: this is where the time goes, and what is not likely is
/// left to others.
///
/// What an edge leaves of the limit, `L r - g` for its squares at rest and now, is carried along a fan, where
/// it is the edge of two triangles. In a tree that is not `UNIFORM`, whose triangles have limits of their
/// own, `r` is not the same for both.
#[inline(never)]
fn passing<
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
) -> usize {
    // One comparison does for both.
    let vertices = surface.len() as u32;
    let ready = if ready < vertices { ready } else { vertices };
    let corner = |corners, number| corner::<I, V, CORNERS>(surface, corners, number, ready);
    let (mut centre, mut first, mut left_by_first) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for (passed, (metric, corners)) in metrics.iter().zip(triangles).enumerate() {
        let [rest_first, rest_between, rest_second] = format::metric_row(metric);
        // Of the triangle before the first nothing is known.
        let is_new = passed == 0 || !format::continues_fan(metric);
        if is_new {
            let Some(a) = corner(corners, 0) else { return passed };
            let Some(b) = corner(corners, 1) else { return passed };
            (centre, first) = (a, b - a);
        }
        if is_new || !UNIFORM {
            left_by_first = limit * rest_first - first.length_squared();
            if !(left_by_first > 0.0) {
                return passed;
            }
        }
        let Some(c) = corner(corners, 2) else { return passed };
        let second = c - centre;
        let left_by_second = limit * rest_second - second.length_squared();
        let now = Edges { first, second };
        if !M::is_within(left_by_first, left_by_second, limit * rest_between, now) {
            return passed;
        }
        (first, left_by_first) = (second, left_by_second);
    }
    if metrics.len() < triangles.len() { metrics.len() } else { triangles.len() }
}

/// Position of a triangle's corner, if it is below row `ready`.
#[inline(always)]
fn corner<I: Index, V: VertexTable + ?Sized, const CORNERS: usize>(
    surface: &V,
    corners: &[u8; CORNERS],
    number: u32,
    ready: u32,
) -> Option<Vec3> {
    let row = format::vertex_number::<I>(corners, number)?;
    if row < ready { surface.position(row) } else { None }
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

/// The squared stretch of a triangle, rounded up; as an error if it is not certainly within the limit.
#[cold]
fn squared_stretch<M: Measure>(rest: &Squares, now: &Squares, limit: f32) -> Result<f32, f32> {
    let estimate = M::estimate(rest, now);
    let mut squared = if estimate.is_nan() { estimate } else { f32::INFINITY };
    // The estimate may be too low by its rounding: a step more, and twice that, until it passes.
    let mut step = 4.0 * U;
    for _ in 0..24 {
        let candidate = estimate * (1.0 + step);
        if M::within(rest, now, candidate) {
            squared = candidate;
            break;
        }
        step *= 2.0;
    }
    if squared <= limit {
        Ok(squared)
    } else if M::within(rest, now, limit) {
        Ok(limit)
    } else {
        Err(squared)
    }
}

/// The square of a stretch limit, rounded down.
fn squared_limit(limit: f32) -> f32 {
    limit * limit * (1.0 - 2.0 * U)
}

/// The root of a square, rounded up.
pub(super) fn root_up(squared: f32) -> f32 {
    sqrt(squared) * (1.0 + 4.0 * U)
}

/// Names a triangle beyond its limit, both in terms of its rest shape.
#[cold]
fn exceeded<I: Index>(tree: &Tree<'_, I>, triangle: u32, squared: f32) -> StretchError {
    let limit = tree.stretch_limit(triangle).unwrap_or(tree.stretch());
    let stretch = root_up(squared) * (limit / tree.stretch());
    StretchError::Exceeded { triangle, stretch, limit }
}

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

/// What a path kind measures.
trait Measure {
    /// The second of the three squares; the others are those of `first` and `second`.
    fn between(first: Vec3, second: Vec3) -> f32;

    /// Whether the stretch is certainly at most `sqrt(limit)`. False for what is not a number.
    fn within(rest: &Squares, now: &Squares, limit: f32) -> bool;

    /// About the square of the stretch.
    fn estimate(rest: &Squares, now: &Squares) -> f32;
}

/// The largest singular value.
struct Surface;

impl Measure for Surface {
    #[inline(always)]
    fn between(first: Vec3, second: Vec3) -> f32 {
        first.dot(second)
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
}

/// The longest of the three edges, each against its rest length.
struct Edges;

impl Measure for Edges {
    #[inline(always)]
    fn between(first: Vec3, second: Vec3) -> f32 {
        (second - first).length_squared()
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
        (PathKind::Surface, 2) => run::<I, V, Surface, 6>(tree, surface, rows, ready, worst),
        (PathKind::Surface, _) => run::<I, V, Surface, 12>(tree, surface, rows, ready, worst),
        (PathKind::EdgePath, 2) => run::<I, V, Edges, 6>(tree, surface, rows, ready, worst),
        (PathKind::EdgePath, _) => run::<I, V, Edges, 12>(tree, surface, rows, ready, worst),
    }
}

/// The run for one measure and `CORNERS` bytes a triangle.
#[inline(always)]
fn run<I: Index, V: VertexTable + ?Sized, M: Measure, const CORNERS: usize>(
    tree: &Tree<'_, I>,
    surface: &V,
    rows: Range<u32>,
    ready: u32,
    worst: &mut Worst,
) -> Result<u32, StretchError> {
    let corrupt = StretchError::Corrupt { row: rows.start };
    let range = rows.start as usize..rows.end as usize;
    let (metrics, _) = tree.sections().metric.as_chunks::<METRIC_BYTES>();
    let (triangles, _) = tree.sections().triangles.as_chunks::<CORNERS>();
    let (Some(metrics), Some(triangles)) = (metrics.get(range.clone()), triangles.get(range))
    else {
        return Err(corrupt);
    };
    let at = |row: u32| surface.position(row).ok_or(StretchError::Corrupt { row });
    // Here, not behind the reference: it is compared with at every triangle.
    let mut largest = worst.squared;
    // The fan's centre, and the edge from it that the next triangle shares.
    let mut centre = Vec3::ZERO;
    let mut first = Vec3::ZERO;
    let mut first_squared = 0.0;
    // No triangle before this run was looked at: it starts its fan anew.
    let mut fresh = true;
    for ((metric, corners), row) in metrics.iter().zip(triangles).zip(rows.clone()) {
        let corner = |number| format::vertex_number::<I>(corners, number);
        if fresh || !format::continues_fan(metric) {
            let (Some(a), Some(b)) = (corner(0), corner(1)) else { return Err(corrupt) };
            if a >= ready || b >= ready {
                return Ok(row);
            }
            centre = at(a)?;
            first = at(b)? - centre;
            first_squared = first.length_squared();
            fresh = false;
        }
        let Some(c) = corner(2) else { return Err(corrupt) };
        if c >= ready {
            return Ok(row);
        }
        let second = at(c)? - centre;
        let second_squared = second.length_squared();
        let now = [first_squared, M::between(first, second), second_squared];
        let Some((rest, _)) = format::metric(metric, 0) else { return Err(corrupt) };
        if !M::within(&rest, &now, largest) {
            let ([a, h, d], [g1, g2, g3]) = (rest, now);
            match squared_stretch::<M>(a, h, d, g1, g2, g3, squared_limit(tree.stretch())) {
                Ok(squared) if squared > largest => {
                    largest = squared;
                    *worst = Worst { squared, triangle: row };
                }
                Ok(_) => (),
                Err(squared) => return Err(exceeded(tree, row, squared)),
            }
        }
        first = second;
        first_squared = second_squared;
    }
    Ok(rows.end)
}

/// The squared stretch of a triangle, rounded up; as an error if it is not certainly within the limit.
///
/// Takes numbers, not arrays: those would be written to memory for every triangle.
#[cold]
#[inline(never)]
fn squared_stretch<M: Measure>(
    a: f32,
    h: f32,
    d: f32,
    g1: f32,
    g2: f32,
    g3: f32,
    limit: f32,
) -> Result<f32, f32> {
    let (rest, now) = (&[a, h, d], &[g1, g2, g3]);
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

//! The reference for tests: closest pairs in f64, by exhaustive search.
//!
//! It shares no code with the kernels under test. Two convex sets are closest at a pair of their faces, so all 21 pairs
//! of faces are tried: {two ends, inside} of the segment with {three corners, three edges, inside} of the triangle.
//! Each is a least-squares problem of at most three unknowns, solved by orthogonalisation. Its solution is clamped to
//! the two sets, so no computed distance is below the true one. [`ClosestPair::lower`] certifies by duality that the
//! least of them is not above it.

use glam::{DVec3, Vec3};

/// A tool's shape: a segment (for a sphere of length zero) with a radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument {
    /// One end of the axis.
    pub start: Vec3,
    /// The other end; the same point for a sphere.
    pub end: Vec3,
    /// Radius around the axis.
    pub radius: f32,
}

impl Instrument {
    /// A sphere.
    pub fn sphere(center: Vec3, radius: f32) -> Self {
        Self { start: center, end: center, radius }
    }

    /// A capsule.
    pub fn capsule(start: Vec3, end: Vec3, radius: f32) -> Self {
        Self { start, end, radius }
    }
}

/// The closest pair of an axis and one triangle.
#[derive(Clone, Copy, Debug)]
pub struct ClosestPair {
    /// Their distance.
    pub distance: f64,
    /// A proven lower bound on the distance: along some direction, the axis' and the triangle's extents are this far
    /// apart. Equal to `distance` up to rounding, unless `distance` is nearly 0.
    pub lower: f64,
    /// The axis' point.
    pub on_axis: DVec3,
    /// The triangle's point.
    pub on_surface: DVec3,
}

/// The closest pair of a tool and a whole surface.
#[derive(Clone, Copy, Debug)]
pub struct OraclePair {
    /// Distance from the tool's axis to the surface.
    pub axis_distance: f64,
    /// Distance from the tool's surface to the mesh, as if the axis were outside: negative if they overlap.
    pub separation: f64,
    /// The axis' point.
    pub on_axis: DVec3,
    /// The surface's point.
    pub on_surface: DVec3,
    /// The triangle's index, the lowest of equally close ones.
    pub triangle: usize,
}

/// The closest pair of the segment from `start` to `end` and a triangle.
///
/// Computed relative to `start` (differences of f32 coordinates are nearly exact in f64), so that the distance is
/// accurate relative to the problem's size, not to the coordinates'.
pub fn closest_pair(start: DVec3, end: DVec3, corners: [DVec3; 3]) -> ClosestPair {
    let pair = closest_from_origin(end - start, corners.map(|c| c - start));
    ClosestPair { on_axis: pair.on_axis + start, on_surface: pair.on_surface + start, ..pair }
}

fn closest_from_origin(end: DVec3, corners: [DVec3; 3]) -> ClosestPair {
    let [a, b, c] = corners;
    let mut best =
        ClosestPair { distance: f64::INFINITY, lower: 0.0, on_axis: DVec3::ZERO, on_surface: a };
    let faces: [(DVec3, &[DVec3]); 7] = [
        (a, &[]),
        (b, &[]),
        (c, &[]),
        (a, &[b - a]),
        (b, &[c - b]),
        (c, &[a - c]),
        (a, &[b - a, c - a]),
    ];
    let all = [(DVec3::ZERO, None), (end, None), (DVec3::ZERO, Some(end))];
    // All three faces of a segment of length zero are the same point.
    let points = if end == DVec3::ZERO { &all[..1] } else { &all[..] };
    for (origin, spans) in faces {
        for &(point, span) in points {
            let mut columns = [DVec3::ZERO; 3];
            columns[..spans.len()].copy_from_slice(spans);
            columns[2] = -span.unwrap_or_default();
            let (solution, residual) = least_squares(columns, point - origin);

            let weights = [solution[0].max(0.0), solution[1].max(0.0)];
            let scale = (weights[0] + weights[1]).max(1.0);
            let on_surface =
                origin + columns[0] * (weights[0] / scale) + columns[1] * (weights[1] / scale);
            let on_axis = point + span.unwrap_or_default() * solution[2].clamp(0.0, 1.0);
            let distance = on_axis.distance(on_surface);
            if distance < best.distance {
                best = ClosestPair { distance, on_axis, on_surface, ..best };
            }
            if let Some(direction) = residual.try_normalize() {
                let axis = end.dot(direction).min(0.0);
                let triangle = a.dot(direction).max(b.dot(direction)).max(c.dot(direction));
                best.lower = best.lower.max(axis - triangle);
            }
        }
    }
    best
}

/// The `x` that minimises `|sum of x_i column_i - target|`, and the residual, by modified Gram-Schmidt. For a column
/// that depends on earlier ones, `x_i` is 0.
fn least_squares(columns: [DVec3; 3], target: DVec3) -> ([f64; 3], DVec3) {
    let mut basis = columns;
    let mut upper = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    let mut rest = target;
    for i in 0..3 {
        let squared = basis[i].length_squared();
        if squared <= 1e-30 * columns[i].length_squared() {
            continue;
        }
        upper[i][i] = squared;
        for j in i + 1..3 {
            upper[i][j] = basis[i].dot(basis[j]) / squared;
            let part = basis[i] * upper[i][j];
            basis[j] -= part;
        }
        right[i] = basis[i].dot(rest) / squared;
        rest -= basis[i] * right[i];
    }
    let mut solution = [0.0; 3];
    for i in (0..3).rev() {
        if upper[i][i] > 0.0 {
            solution[i] = right[i] - (i + 1..3).map(|j| upper[i][j] * solution[j]).sum::<f64>();
        }
    }
    (solution, rest)
}

/// Distance from a point to the segment from `start` to `end`.
fn point_distance(start: DVec3, end: DVec3, point: DVec3) -> f64 {
    let (span, offset) = (end - start, point - start);
    let length_squared = span.length_squared();
    let along = if length_squared > 0.0 {
        (offset.dot(span) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (offset - span * along).length()
}

/// The least distance from the segment from `start` to `end` to any of the triangles; infinite for none.
///
/// A triangle is skipped only if the distance of its first corner exceeds the least distance so far by more than the
/// triangle's extent from that corner.
pub fn least_distance(
    start: DVec3,
    end: DVec3,
    triangles: impl IntoIterator<Item = [DVec3; 3]>,
) -> f64 {
    let mut least = f64::INFINITY;
    for corners in triangles {
        if !is_beyond(least, point_distance(start, end, corners[0]), corners) {
            least = least.min(closest_pair(start, end, corners).distance);
        }
    }
    least
}

/// Whether no point of a triangle is as near as `least`, judged by the distance of its first corner.
fn is_beyond(least: f64, first: f64, [a, b, c]: [DVec3; 3]) -> bool {
    let reach = a.distance(b).max(a.distance(c));
    // The margin covers the rounding of this line.
    first - reach > least + 1e-9 * (first + reach)
}

/// The closest pair of a tool and a surface, over all its triangles; `None` for no triangles.
///
/// Equivalent to an exhaustive search: triangles are only skipped as in [`least_distance`].
///
/// Positions are in f32 or f64.
///
/// # Panics
/// If a triangle names a vertex that does not exist.
pub fn exhaustive<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
) -> Option<OraclePair> {
    let (start, end) = (tool.start.as_dvec3(), tool.end.as_dvec3());
    let corners = |triangle: &[u32; 3]| triangle.map(|v| positions[v as usize].into());
    let first: Vec<f64> = triangles
        .iter()
        .map(|t| point_distance(start, end, positions[t[0] as usize].into()))
        .collect();
    let mut nearest = first.iter().copied().fold(f64::INFINITY, f64::min);
    let mut best: Option<OraclePair> = None;
    for (number, triangle) in triangles.iter().enumerate() {
        let corners = corners(triangle);
        if is_beyond(nearest, first[number], corners) {
            continue;
        }
        let pair = closest_pair(start, end, corners);
        nearest = nearest.min(pair.distance);
        if best.is_none_or(|b| pair.distance < b.axis_distance) {
            best = Some(OraclePair {
                axis_distance: pair.distance,
                separation: pair.distance - f64::from(tool.radius),
                on_axis: pair.on_axis,
                on_surface: pair.on_surface,
                triangle: number,
            });
        }
    }
    best
}

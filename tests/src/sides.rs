//! The reference for sides, in f64: generalised winding numbers, pseudonormals, and signed separations.

use glam::{DVec3, Vec3};

use crate::oracle::{Instrument, OraclePair, closest_pair, exhaustive, least_distance};

/// The winding number of a surface around a point: 1 inside a closed surface that faces outwards, 0 outside.
///
/// The sum of the triangles' solid angles (van Oosterom & Strackee 1983; Jacobson et al. 2013).
#[must_use]
pub fn winding_number<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    point: DVec3,
) -> f64 {
    let solid_angle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| positions[v as usize].into() - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let volume = a.dot(b.cross(c));
        2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Whether a point is inside a closed surface; `None` if the winding number is neither 0 nor 1, because the surface
/// intersects itself or the point lies on it.
#[must_use]
pub fn is_inside<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    point: DVec3,
) -> Option<bool> {
    let winding = winding_number(positions, triangles, point);
    if winding.abs() < 0.1 {
        Some(false)
    } else if (winding - 1.0).abs() < 0.1 {
        Some(true)
    } else {
        None
    }
}

/// Depth of a point in a closed surface, negative outside; `None` if the winding number is ambiguous.
#[must_use]
pub fn depth<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    point: Vec3,
) -> Option<f64> {
    let nearest = exhaustive(positions, triangles, &Instrument::sphere(point, 0.0))?;
    let inside = is_inside(positions, triangles, point.as_dvec3())?;
    Some(if inside { nearest.axis_distance } else { -nearest.axis_distance })
}

/// The side of the nearest sheet: the sign of the angle-weighted pseudonormal at the closest point, over all triangles.
/// It differs from [`is_inside`] only where the surface intersects itself.
#[must_use]
pub fn is_below<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    pair: &OraclePair,
) -> bool {
    let corners = |triangle: [u32; 3]| triangle.map(|v| positions[v as usize].into());
    let is_at = |p: DVec3| p.distance(pair.on_surface) < 1e-9;
    let row = triangles[pair.triangle];
    let vertex = (0..3).find(|&i| is_at(corners(row)[i])).map(|i| row[i]);
    let on_edge = |a: DVec3, b: DVec3| is_at(a + (b - a) * along(a, b, pair.on_surface));
    let edge = (0..3).map(|i| (i, (i + 1) % 3));
    let edge = edge.into_iter().find(|&(i, j)| on_edge(corners(row)[i], corners(row)[j]));
    let mut sum = DVec3::ZERO;
    for (number, &triangle) in triangles.iter().enumerate() {
        let [a, b, c] = corners(triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let weight = match (vertex, edge) {
            (Some(vertex), _) => {
                let Some(at) = triangle.iter().position(|&v| v == vertex) else { continue };
                let [centre, from, to] = [a, b, c, a, b][at..at + 3] else { unreachable!() };
                (from - centre).angle_between(to - centre)
            }
            (None, Some((i, j))) => {
                f64::from(u8::from(triangle.contains(&row[i]) && triangle.contains(&row[j])))
            }
            (None, None) => f64::from(u8::from(number == pair.triangle)),
        };
        sum += normal * weight;
    }
    (pair.on_axis - pair.on_surface).dot(sum) < 0.0
}

/// Whether the sheet nearest to a point proves that the surface intersects itself there.
///
/// A triangle separates a region of winding number `k` above it from one of `k + 1` below. On a closed surface that
/// faces outwards and does not intersect itself, `k` is 0. The tested points lie next to the closest point, above and
/// below each triangle that touches it, so close that no fold is between them.
#[must_use]
pub fn is_cut<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    pair: &OraclePair,
) -> bool {
    let winds = |at: DVec3| winding_number(positions, triangles, at);
    let corners = |triangle: &[u32; 3]| triangle.map(|v| positions[v as usize].into());
    let proves = |triangle: &[u32; 3], (share, height): (f64, f64)| {
        let [a, b, c] = corners(triangle);
        let at = pair.on_surface.lerp((a + b + c) / 3.0, share);
        let across = (b - a).cross(c - a);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        // Less than the distance from the triangle's edges.
        let up = across.normalize_or_zero() * (across.length() / longest * share * height);
        let (above, below) = (winds(at + up), winds(at - up));
        // The winding numbers differ by 1: no other sheet is between the two points.
        (below - above - 1.0).abs() < 0.1 && above.abs() > 0.9
    };
    let touches = |triangle: &&[u32; 3]| {
        closest_pair(pair.on_surface, pair.on_surface, corners(triangle)).distance < 1e-9
    };
    let touching: Vec<_> = triangles.iter().filter(touches).collect();
    [(1e-3, 3e-3), (1e-2, 1e-5), (1e-5, 3e-3), (1e-2, 1e-7)]
        .into_iter()
        .any(|place| touching.iter().any(|triangle| proves(triangle, place)))
}

/// Whether a surface is proven to intersect itself next to one of `points + 1` points of an axis, so that the depth
/// jumps along the axis.
#[must_use]
pub fn is_cut_along<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
    points: u32,
) -> bool {
    (0..=points).any(|step| {
        let at = tool.start.lerp(tool.end, step as f32 / points as f32);
        let nearest = exhaustive(positions, triangles, &Instrument::sphere(at, 0.0));
        nearest.is_some_and(|nearest| is_cut(positions, triangles, &nearest))
    })
}

/// Parameter of the point on the segment from `a` (0) to `b` (1) that is nearest to a point.
fn along(a: DVec3, b: DVec3, point: DVec3) -> f64 {
    ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0)
}

/// An interval that contains the signed separation of a tool whose axis crosses a closed surface or is inside, from the
/// depths of `points + 1` points of the axis.
#[must_use]
pub fn deepest_separation<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
    points: u32,
) -> Option<(f64, f64)> {
    let mut deepest = 0.0;
    for step in 0..=points {
        let at = tool.start.lerp(tool.end, step as f32 / points as f32);
        let nearest = exhaustive(positions, triangles, &Instrument::sphere(at, 0.0))?;
        // The side is only needed for a point farther from the surface than the deepest so far.
        if nearest.axis_distance > deepest && is_inside(positions, triangles, at.as_dvec3())? {
            deepest = nearest.axis_distance;
        }
    }
    // The depth changes by at most the length along the axis.
    let between = f64::from(tool.start.distance(tool.end)) / f64::from(points) / 2.0;
    let radius = f64::from(tool.radius);
    Some((-radius - deepest - between, -radius - deepest))
}

/// An interval that contains the signed separation of any tool from a closed surface. If the axis is within `accuracy`
/// of the surface, the interval covers crossing and not crossing; where it intersects itself, both sides.
#[must_use]
pub fn signed_separation<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
    pair: &OraclePair,
    accuracy: f64,
) -> (f64, f64) {
    const POINTS: u32 = 8;
    let (distance, radius) = (pair.axis_distance, f64::from(tool.radius));
    let length = f64::from(tool.start.distance(tool.end));
    let most = -radius - distance - length;
    let low =
        || deepest_separation(positions, triangles, tool, POINTS).map_or(most, |(low, _)| low);
    if distance <= accuracy {
        return (low(), -radius);
    }
    match is_inside(positions, triangles, pair.on_axis) {
        Some(false) => (distance - radius, distance - radius),
        Some(true) if length > 0.0 => (low(), -distance - radius),
        Some(true) => (-distance - radius, -distance - radius),
        None => (most, distance - radius),
    }
}

/// Most points at which [`bounded_separation`] takes a depth.
const DEPTHS: usize = 100;

/// An interval that contains the signed separation of any tool from a closed surface, at most `tolerance` wide where a
/// hundred points of the axis suffice for that. `None` where the surface intersects itself.
#[must_use]
pub fn bounded_separation<P: Copy + Into<DVec3>>(
    positions: &[P],
    triangles: &[[u32; 3]],
    tool: &Instrument,
    tolerance: f64,
) -> Option<(f64, f64)> {
    let radius = f64::from(tool.radius);
    let (start, end) = (tool.start.as_dvec3(), tool.end.as_dvec3());
    let length = start.distance(end);
    let pair = exhaustive(positions, triangles, tool)?;
    if pair.axis_distance > 1e-6 && !is_inside(positions, triangles, pair.on_axis)? {
        let apart = pair.axis_distance - radius;
        return Some((apart, apart));
    }
    let signed = |t: f64| {
        let at = start.lerp(end, t);
        let corners = triangles.iter().map(|t| t.map(|v| positions[v as usize].into()));
        let distance = least_distance(at, at, corners);
        is_inside(positions, triangles, at).map(|inside| if inside { -distance } else { distance })
    };
    // A signed distance changes by at most the length along the axis: the part with the least bound is halved.
    let bound = |[from, to]: [(f64, f64); 2]| (from.1 + to.1 - (to.0 - from.0) * length) / 2.0;
    let mut parts = vec![[(0.0, signed(0.0)?), (1.0, signed(1.0)?)]];
    let mut least = parts[0][0].1.min(parts[0][1].1);
    for _ in 0..DEPTHS {
        let lowest =
            (0..parts.len()).min_by(|&a, &b| bound(parts[a]).total_cmp(&bound(parts[b])))?;
        if bound(parts[lowest]) > least - tolerance {
            break;
        }
        let [from, to] = parts.swap_remove(lowest);
        let t = (from.0 + to.0) / 2.0;
        let middle = (t, signed(t)?);
        least = least.min(middle.1);
        parts.extend([[from, middle], [middle, to]]);
    }
    let low = parts.into_iter().map(bound).fold(least, f64::min);
    Some((low - radius, least - radius))
}

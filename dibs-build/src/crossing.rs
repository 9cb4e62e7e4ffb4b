//! Parts of a surface that cross or touch each other at rest.

use std::fmt;

use dibs_nostd::format::MAX_ROOTS;
use glam::DVec3;

use crate::Mesh;
use crate::components::connected_by_vertices;

/// Most pairs of triangles compared. Pairs beyond that count as apart: this is a warning, not a proof.
const MOST_COMPARED: usize = 4_000_000;

/// A determinant below this, relative to the lengths in it, is zero.
const FLAT: f64 = 1e-12;

/// Two parts that share no vertex, and cross or touch at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CrossingParts {
    /// A triangle of one part.
    pub triangle: usize,
    /// A triangle of the other part that it meets.
    pub other: usize,
}

impl fmt::Display for CrossingParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { triangle, other } = self;
        write!(
            f,
            "two parts of the surface cross or touch at rest, at triangles {triangle} and {other}: a tool is inside if it \
             is inside one of them, and the wall between them is none"
        )
    }
}

/// The pairs of parts that cross or touch at rest, with two triangles that meet.
/// Cost: linear in the triangles. Triangles of two parts whose boxes overlap are sorted along one axis and compared, up
/// to four million pairs. A mesh with more parts than a tree has roots is not checked.
#[must_use]
pub(crate) fn crossing_parts(mesh: &Mesh) -> Vec<CrossingParts> {
    let parts = connected_by_vertices(&mesh.triangles);
    if parts.len() > MAX_ROOTS as usize {
        return Vec::new();
    }
    let mut left = MOST_COMPARED;
    let boxes: Vec<Bounds> = parts.iter().map(|part| Bounds::of(mesh, part)).collect();
    let mut found = Vec::new();
    for (at, one) in parts.iter().enumerate() {
        for (beside, other) in parts.iter().enumerate().skip(at + 1) {
            if boxes[at].meets(&boxes[beside]) {
                let (one, other) = (near(mesh, one, &boxes[beside]), near(mesh, other, &boxes[at]));
                found.extend(first_crossing(mesh, &one, &other, &mut left));
            }
        }
    }
    found
}

/// The triangles of a part that meet a box, by their least x.
fn near(mesh: &Mesh, part: &[usize], bounds: &Bounds) -> Vec<(usize, Bounds)> {
    let own = |&triangle: &usize| (triangle, Bounds::of(mesh, &[triangle]));
    let mut near: Vec<_> = part.iter().map(own).filter(|(_, own)| own.meets(bounds)).collect();
    near.sort_by(|(_, a), (_, b)| a.low.x.total_cmp(&b.low.x));
    near
}

fn first_crossing(
    mesh: &Mesh,
    one: &[(usize, Bounds)],
    other: &[(usize, Bounds)],
    left: &mut usize,
) -> Option<CrossingParts> {
    // A triangle that reaches this one begins at most the widest triangle's width before it.
    let widest = other.iter().map(|(_, bounds)| bounds.high.x - bounds.low.x).fold(0.0, f64::max);
    for (triangle, bounds) in one {
        let from = other.partition_point(|(_, other)| other.low.x < bounds.low.x - widest);
        for (beside, other) in &other[from..] {
            if other.low.x > bounds.high.x {
                break;
            }
            *left = left.checked_sub(1)?;
            let corners = [triangle, beside].map(|&row| mesh.corners(mesh.triangles[row]));
            if other.meets(bounds) && meet(corners.map(|corners| corners.map(glam::Vec3::as_dvec3)))
            {
                return Some(CrossingParts { triangle: *triangle, other: *beside });
            }
        }
    }
    None
}

/// Whether two triangles have a point in common: whether an edge of one meets the other. Of coplanar triangles only the
/// corners and one point inside are tested.
fn meet([one, other]: [[DVec3; 3]; 2]) -> bool {
    let pierces = |[a, b, c]: [DVec3; 3], triangle: [DVec3; 3]| {
        [(a, b), (b, c), (c, a)].into_iter().any(|(from, to)| edge_meets(from, to, triangle))
            || edge_meets(a, (b + c) * 0.5, triangle)
    };
    pierces(one, other) || pierces(other, one)
}

/// Whether a segment and a triangle have a point in common. For a segment in the triangle's plane: whether its start is
/// in the triangle.
fn edge_meets(from: DVec3, to: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a);
    let (before, after) = (normal.dot(from - a), normal.dot(to - a));
    let zero = FLAT * normal.length() * ((from - a).length() + (to - a).length());
    if (before > zero && after > zero) || (before < -zero && after < -zero) {
        return false;
    }
    let is_in_plane = before.abs() <= zero && after.abs() <= zero;
    let share = if is_in_plane { 0.0 } else { before / (before - after) };
    let point = from + (to - from) * share;
    [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
        let side = normal.dot((to - from).cross(point - from));
        side >= -FLAT * normal.length() * (to - from).length() * (point - from).length()
    })
}

/// An axis-aligned box.
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(mesh: &Mesh, triangles: &[usize]) -> Self {
        let none = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        triangles.iter().flat_map(|&row| mesh.corners(mesh.triangles[row])).fold(
            none,
            |Self { low, high }, corner| {
                let corner = corner.as_dvec3();
                Self { low: low.min(corner), high: high.max(corner) }
            },
        )
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A tetrahedron whose corner is at `at`.
    fn tetrahedron(mesh: &mut Mesh, at: Vec3, size: f32) {
        let first = mesh.positions.len() as u32;
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        mesh.positions.extend(corners.map(|corner| at + size * corner));
        for corners in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            mesh.triangles.push(corners.map(|corner| corner + first));
        }
    }

    fn found(parts: &[(Vec3, f32)]) -> usize {
        let mut mesh = Mesh::default();
        parts.iter().for_each(|&(at, size)| tetrahedron(&mut mesh, at, size));
        crossing_parts(&mesh).len()
    }

    #[test]
    fn parts_that_cross_or_touch_are_found() {
        let big = (Vec3::ZERO, 10.0);
        for (case, other, expected) in [
            ("beside", (Vec3::new(20.0, 0.0, 0.0), 10.0), 0),
            ("inside", (Vec3::splat(1.0), 1.0), 0),
            ("boxes overlap alone", (Vec3::splat(8.0), 1.0), 0),
            ("across a face", (Vec3::new(-1.0, 1.0, 1.0), 3.0), 1),
            ("a corner on a face", (Vec3::new(2.0, 2.0, 0.0), -1.0), 1),
            ("a common face", (Vec3::new(1.0, 1.0, 0.0), 2.0), 1),
            ("the same", big, 1),
        ] {
            assert_eq!(found(&[big, other]), expected, "{case}");
        }
        assert_eq!(found(&[big, (Vec3::new(-1.0, 1.0, 1.0), 3.0), (Vec3::splat(50.0), 1.0)]), 1);
    }
}

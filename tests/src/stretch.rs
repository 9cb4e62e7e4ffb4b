//! Stretch in f64, independent of the measurement under test: for triangles by singular values of the deformation
//! gradient in an orthonormal basis, for edges by lengths.

use dibs_build::Mesh;
use dibs_nostd::format::PathKind;
use glam::{DMat2, DVec2, DVec3, Vec3};

/// The largest stretch of `now` relative to the rest shape, over all triangles or edges.
#[must_use]
pub fn largest(mesh: &Mesh, now: &[Vec3], paths: PathKind) -> f64 {
    (0..mesh.triangles.len()).map(|t| of_triangle(mesh, now, t, paths)).fold(0.0, f64::max)
}

/// The stretch of one triangle.
#[must_use]
pub fn of_triangle(mesh: &Mesh, now: &[Vec3], triangle: usize, paths: PathKind) -> f64 {
    let corners = mesh.triangles[triangle];
    let rest = corners.map(|v| mesh.positions[v as usize].as_dvec3());
    let now = corners.map(|v| now[v as usize].as_dvec3());
    match paths {
        PathKind::EdgePath => (0..3)
            .map(|i| now[i].distance(now[(i + 1) % 3]) / rest[i].distance(rest[(i + 1) % 3]))
            .fold(0.0, f64::max),
        _ => largest_singular_value(rest, now),
    }
}

/// The largest singular value of `F = [now] [rest]^-1`, from the 2x2 edge matrices of both shapes in their planes.
fn largest_singular_value(rest: [DVec3; 3], now: [DVec3; 3]) -> f64 {
    let gradient = flat(now) * higher(flat(rest)).inverse();
    let metric = gradient.transpose() * gradient;
    let (trace, determinant) = (metric.x_axis.x + metric.y_axis.y, metric.determinant());
    let root = (trace * trace / 4.0 - determinant).max(0.0).sqrt();
    (trace / 2.0 + root).sqrt()
}

/// Raises a triangle whose height is less than 1/64 of its longest edge to that height, by stretching it across that
/// edge: the measurement under test treats rest shapes in the same way.
fn higher(edges: DMat2) -> DMat2 {
    let (first, second) = (edges.x_axis, edges.y_axis);
    let longest = [first, second, second - first]
        .into_iter()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(first);
    let height = edges.determinant().abs() / longest.length();
    let factor = (longest.length() / 64.0 / height).max(1.0);
    let across = longest.perp() / longest.length();
    let stretched = |edge: DVec2| edge + across * across.dot(edge) * (factor - 1.0);
    DMat2::from_cols(stretched(first), stretched(second))
}

/// The triangle's two edges in an orthonormal basis of its plane.
fn flat([a, b, c]: [DVec3; 3]) -> DMat2 {
    let (along, across) = (b - a, c - a);
    let x = along.normalize_or(DVec3::X);
    let rest = across - x * across.dot(x);
    DMat2::from_cols(DVec2::new(along.length(), 0.0), DVec2::new(across.dot(x), rest.length()))
}

//! The paper's construction, kept beside the default for comparison.
//!
//! Bowyer & Rodriguez y Baena 2014, "construction": the pin is the vertex nearest to the middle of the section's
//! coordinate ranges. A plane normal to the main axis of the vertices' covariance cuts the section through the middle
//! of their projections. A part that is not contiguous with the rest of its side is an orphan and goes to the sibling.

use glam::{DMat3, DVec3};

use super::pin::{self, Pin};
use super::section::{Searches, Section, Surface};
use super::split;
use crate::components::connected_by_vertices;

/// The vertex nearest to the mid-range of the section, and its geodesic radius.
pub(crate) fn mid_range_pin(
    surface: &Surface<'_>,
    section: &Section,
    searches: &mut Searches,
) -> Pin {
    let at = |v: u32| surface.mesh.positions[v as usize].as_dvec3();
    let low = section.vertices.iter().map(|&v| at(v)).fold(DVec3::INFINITY, DVec3::min);
    let high = section.vertices.iter().map(|&v| at(v)).fold(DVec3::NEG_INFINITY, DVec3::max);
    let middle = (low + high) / 2.0;
    let distance = |v: u32| at(v).distance_squared(middle);
    let order = |a: &u32, b: &u32| distance(*a).total_cmp(&distance(*b)).then(a.cmp(b));
    let vertex = section.vertices.iter().copied().min_by(order).unwrap_or(section.vertices[0]);
    pin::evaluate(surface, section, searches, vertex)
}

/// The plane split, with orphans moved to the sibling.
pub(crate) fn split(surface: &Surface<'_>, section: &Section, even: bool) -> [Vec<u32>; 2] {
    let mesh = surface.mesh;
    let at = |v: u32| mesh.positions[v as usize].as_dvec3();
    let axis = main_axis(section.vertices.iter().map(|&v| at(v)));
    let projections = section.vertices.iter().map(|&v| at(v).dot(axis));
    let low = projections.clone().fold(f64::INFINITY, f64::min);
    let high = projections.fold(f64::NEG_INFINITY, f64::max);
    let middle = (low + high) / 2.0;
    let centroid = |t: u32| mesh.triangles[t as usize].map(at).into_iter().sum::<DVec3>() / 3.0;
    let key = |t: u32| centroid(t).dot(axis) - middle;
    let keyed: Vec<(f64, u32)> = section.triangles.iter().map(|&t| (key(t), t)).collect();
    if even {
        return split::at_zero(keyed, 0.5);
    }
    let mut sides = split::at_zero(keyed.clone(), 0.0);
    for (from, to) in [(0, 1), (1, 0)] {
        let mut parts = contiguous_parts(surface, &sides[from]);
        let kept = parts.remove(0);
        sides[to].extend(parts.into_iter().flatten());
        sides[to].sort_unstable();
        sides[from] = kept;
    }
    if sides.iter().all(|side| contiguous_parts(surface, side).len() == 1) {
        sides
    } else {
        // After orphans have moved, a half is no longer contiguous, which section-restricted paths require: split off
        // one triangle instead.
        peel(surface, section)
    }
}

/// Splits off one border triangle whose removal leaves the rest contiguous.
fn peel(surface: &Surface<'_>, section: &Section) -> [Vec<u32>; 2] {
    let without =
        |t: u32| section.triangles.iter().copied().filter(|&o| o != t).collect::<Vec<_>>();
    let loose = |&t: &u32| contiguous_parts(surface, &without(t)).len() == 1;
    let one = section.triangles.iter().copied().find(loose).unwrap_or(section.triangles[0]);
    [vec![one], without(one)]
}

/// Unit eigenvector of the largest eigenvalue of the points' covariance, by power iteration.
pub(super) fn main_axis(points: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let count = points.clone().count() as f64;
    let mean = points.clone().sum::<DVec3>() / count;
    let mut covariance = DMat3::ZERO;
    for point in points {
        let d = point - mean;
        covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    // Squaring the matrix ten times raises the ratio of the eigenvalues to the 1,024th power.
    for _ in 0..10 {
        let size = covariance.to_cols_array().into_iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if size == 0.0 {
            return DVec3::X;
        }
        covariance *= 1.0 / size;
        covariance = covariance * covariance;
    }
    let columns = [covariance.x_axis, covariance.y_axis, covariance.z_axis];
    let longest = columns.into_iter().max_by(|a, b| a.length().total_cmp(&b.length()));
    longest.map_or(DVec3::X, |axis| axis.normalize_or(DVec3::X))
}

/// The parts of a set of triangles that are connected by shared vertices, largest first.
fn contiguous_parts(surface: &Surface<'_>, triangles: &[u32]) -> Vec<Vec<u32>> {
    let corners: Vec<[u32; 3]> =
        triangles.iter().map(|&triangle| surface.mesh.triangles[triangle as usize]).collect();
    let parts = connected_by_vertices(&corners).into_iter();
    parts.map(|part| part.into_iter().map(|at| triangles[at]).collect()).collect()
}

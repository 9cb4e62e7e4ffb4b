//! The ventricles of a heart, cut at the base: one closed surface with two deep cavities.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::contour::contour;
use super::remesh::{Surface, area_vector, remesh};
use super::{GenerateError, MovingMesh, beat, check};
use crate::Mesh;

const TRIANGLES: RangeInclusive<u32> = 320..=1_000_000;

/// Height at which the base is cut, mm; the apex is at -10.
pub(super) const BASE: f64 = 86.0;
/// Outer surface of the left ventricle: centre and semi-axes of an ellipsoid about the z axis.
pub(super) const LEFT: Ellipsoid =
    Ellipsoid { centre: DVec3::new(0.0, 0.0, 66.0), axes: DVec3::new(34.0, 34.0, 76.0) };
const LEFT_CAVITY: Ellipsoid =
    Ellipsoid { centre: DVec3::new(0.0, 0.0, 70.0), axes: DVec3::new(24.0, 24.0, 65.0) };
const RIGHT: Ellipsoid =
    Ellipsoid { centre: DVec3::new(20.0, -5.0, 71.0), axes: DVec3::new(39.0, 38.0, 68.0) };
const RIGHT_CAVITY: Ellipsoid =
    Ellipsoid { centre: DVec3::new(20.0, -5.0, 71.0), axes: DVec3::new(33.5, 32.5, 61.0) };

/// A beating human-like heart of exactly `triangles` triangles (even, 320 to 1,000,000), in mm: the
/// left ventricle's wall is about 10 mm thick, the right one's 5 mm, the whole 96 mm long with its
/// apex towards -z.
///
/// The motion is one cycle of 25 frames at 72 beats a minute. Frame 0 is the mesh itself. No
/// triangle's largest principal stretch and no edge's stretch exceeds 1.45 against it in any frame;
/// both are convex in the positions, so the same holds for positions interpolated linearly between
/// any frames.
///
/// Cost: less than a second for 10,272 triangles in a release build.
///
/// # Errors
/// [`GenerateError::TriangleCount`] for an odd number or one outside the range.
/// [`GenerateError::Stuck`] if the mesh cannot be brought to that number; no such number is known.
///
/// ```
/// let heart = dibs_build::generate::heart(1000)?;
/// assert_eq!(heart.mesh.triangles.len(), 1000);
/// assert_eq!(heart.motion.frames[0], heart.mesh.positions);
/// # Ok::<(), dibs_build::generate::GenerateError>(())
/// ```
pub fn heart(triangles: u32) -> Result<MovingMesh, GenerateError> {
    check("heart", triangles, TRIANGLES)?;
    // The surface measures about 43,000 mm^2; the first, rough mesh has a few times the requested triangles.
    let step = (43_000.0 / f64::from(triangles)).sqrt().clamp(0.8, 3.0);
    let (low, high) = (DVec3::new(-38.0, -47.0, -14.0), DVec3::new(63.0, 38.0, 90.0));
    let mut mesh = contour(wall, low, high, step);
    // A coarse mesh is made from a finer one, which follows the rims of the walls closely.
    for count in [triangles.max(4000), triangles] {
        mesh = remesh(mesh.0, &mesh.1, &Wall, count as usize).map_err(|reached| {
            GenerateError::Stuck { surface: "heart", asked: triangles, reached }
        })?;
        if count == triangles {
            break;
        }
    }
    let (points, triangles) = mesh;
    let mesh = Mesh {
        positions: points.iter().map(|point| point.as_vec3()).collect(),
        triangles,
        ..Mesh::default()
    };
    let motion = beat(&mesh.positions);
    Ok(MovingMesh { mesh, motion })
}

pub(super) struct Ellipsoid {
    centre: DVec3,
    axes: DVec3,
}

impl Ellipsoid {
    /// Distance from the centre, 1 at the surface.
    pub fn level(&self, point: DVec3) -> f64 {
        ((point - self.centre) / self.axes).length()
    }

    /// The signed distance in mm, approximately; negative inside.
    fn distance(&self, point: DVec3) -> f64 {
        let level = self.level(point);
        let slope = ((point - self.centre) / (self.axes * self.axes)).length();
        if slope > 1e-6 { level * (level - 1.0) / slope } else { -self.axes.min_element() }
    }
}

/// Negative within the muscle, positive outside and in the cavities; in mm near the surface.
fn wall(point: DVec3) -> f64 {
    let left = LEFT.distance(point);
    let outside = -smooth_max(-left, -RIGHT.distance(point), 10.0);
    let left_cavity = LEFT_CAVITY.distance(point);
    let right_cavity = smooth_max(RIGHT_CAVITY.distance(point), -left, 10.0);
    let body = smooth_max(outside, point.z - BASE, 4.0);
    smooth_max(smooth_max(body, -left_cavity, 4.0), -right_cavity, 4.0)
}

/// The maximum, rounded off where the two differ by less than `width`.
fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    let overlap = (1.0 - (a - b).abs() / width).max(0.0);
    a.max(b) + overlap * overlap * width / 4.0
}

struct Wall;

impl Surface for Wall {
    fn project(&self, point: DVec3) -> (DVec3, DVec3) {
        let mut at = point;
        for _ in 0..3 {
            let gradient = gradient(at);
            at -= gradient * (wall(at) / gradient.length_squared().max(0.1));
        }
        (at, gradient(at).normalize_or_zero())
    }

    fn alignment(&self, corners: [DVec3; 3], normals: [DVec3; 3]) -> f64 {
        let facing = area_vector(corners).normalize_or_zero();
        normals.map(|normal| normal.dot(facing)).into_iter().fold(1.0, f64::min)
    }

    const PROJECTS_TO_NORMALS: bool = true;

    /// Zero, because a triangle may bridge the rim of a thin wall at right angles to the surface on both sides.
    const LEAST_ALIGNMENT: f64 = 0.0;
}

/// Gradient by central differences.
fn gradient(point: DVec3) -> DVec3 {
    const STEP: f64 = 1e-4;
    DVec3::AXES
        .map(|axis| (wall(point + axis * STEP) - wall(point - axis * STEP)) * axis)
        .iter()
        .sum::<DVec3>()
        / (2.0 * STEP)
}

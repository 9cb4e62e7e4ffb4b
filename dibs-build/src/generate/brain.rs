//! The folded surface of a brain: gyri, sulci, and the fissure between the hemispheres.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::noise::noise;
use super::remesh::{Surface, area_vector, remesh};
use super::{GenerateError, check};
use crate::Mesh;

const TRIANGLES: RangeInclusive<u32> = 500..=500_000;

/// Half the width (x), length (y) and height (z), mm.
const AXES: DVec3 = DVec3::new(67.0, 86.0, 60.0);
/// Area of that ellipsoid, mm^2.
const HULL: f64 = 63_000.0;
/// Mean depth of the sulci, mm.
const DEPTH: f64 = 12.0;

/// A human-like cortex of exactly `triangles` triangles (even, 500 to 500,000), in mm: 170 mm long,
/// with sulci 8 to 15 mm deep and a deeper fissure between the hemispheres.
///
/// The surface is a height field over the sphere of directions from its centre, so it cannot cut
/// itself. Where triangles are too large for gyri of natural width (about 11 mm; below some 34,000
/// triangles), the gyri are wider.
///
/// Cost in a release build: about 2 s for 50,000 triangles, 20 s for 500,000.
///
/// # Errors
/// [`GenerateError::TriangleCount`] for an odd number or one outside the range.
/// [`GenerateError::Stuck`] if the mesh cannot be brought to that number; no such number is known.
///
/// ```
/// let brain = dibs_build::generate::brain(1000)?;
/// assert_eq!(brain.triangles.len(), 1000);
/// # Ok::<(), dibs_build::generate::GenerateError>(())
/// ```
pub fn brain(triangles: u32) -> Result<Mesh, GenerateError> {
    check("brain", triangles, TRIANGLES)?;
    let spread =
        |start: (Vec<DVec3>, Vec<[u32; 3]>), cortex: &Cortex, count: u32| {
            remesh(start.0, &start.1, cortex, count as usize).map_err(|reached| {
                GenerateError::Stuck { surface: "brain", asked: triangles, reached }
            })
        };
    // Start with a smooth brain of few triangles, made from an octahedron. The folds then stretch the triangles, so
    // that remeshing mostly splits.
    let corners = DVec3::AXES.into_iter().chain(DVec3::AXES.map(|axis| -axis)).collect();
    let faces = (0..8u32).map(|octant| {
        let [x, y, z] = [0, 1, 2].map(|axis| axis + 3 * ((octant >> axis) & 1));
        if octant.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] }
    });
    let cortex = Cortex::for_triangles(triangles);
    let mut mesh = (corners, faces.collect());
    for (depth, share) in [(0.0, 0.25), (0.3, 0.4), (0.6, 0.7)] {
        let shallow = Cortex { depth, ..cortex };
        mesh = spread(mesh, &shallow, (f64::from(triangles.min(60_000)) * share) as u32 & !1)?;
    }
    let (points, triangles) = spread(mesh, &cortex, triangles)?;
    Ok(Mesh {
        positions: points.iter().map(|point| point.as_vec3()).collect(),
        triangles,
        ..Mesh::default()
    })
}

struct Cortex {
    /// Mean distance between neighbouring sulci, mm.
    spacing: f64,
    /// Depth of the folds, as a fraction of the final depth.
    depth: f64,
}

impl Cortex {
    fn for_triangles(triangles: u32) -> Self {
        let mut spacing = 11.0f64;
        for _ in 0..20 {
            let area = HULL * (1.0 + 2.0 * DEPTH / spacing);
            let edge = (area / f64::from(triangles) * 4.0 / 3f64.sqrt()).sqrt();
            spacing = (3.0 * edge).max(11.0);
        }
        Self { spacing, depth: 1.0 }
    }

    /// Distance of the surface from the centre along the unit vector `direction`.
    fn radius(&self, direction: DVec3) -> f64 {
        let hull = 1.0 / (direction / AXES).length();
        // The underside is flatter than the top.
        let below = (-direction.z).max(0.0);
        let hull = hull * (1.0 - 0.18 * below * below);
        if self.depth == 0.0 {
            return hull;
        }
        let place = direction * hull;

        // Sulci run along the zeros of a noise; its value over its slope is the distance to them in mm.
        let (value, slope) = self.folds(place);
        let across = slope - direction * slope.dot(direction);
        let width = 0.34 * self.spacing;
        let away = value / (across.length_squared() + 0.25 / (self.spacing * self.spacing)).sqrt();
        let (vary, _) = noise(5, place / 35.0);
        let depth = DEPTH + 3.0 * vary.clamp(-1.0, 1.0);
        let sulcus = depth * libm::exp(-(away / width) * (away / width));

        // The fissure is deepest on top and fades out below.
        let half = 0.35 * self.spacing;
        let open = ((direction.z + 0.5) / 0.8).clamp(0.0, 1.0);
        let fissure = 20.0
            * (open * open * (3.0 - 2.0 * open))
            * libm::exp(-(place.x / half) * (place.x / half));
        hull - self.depth * (sulcus * sulcus + fissure * fissure).sqrt()
    }

    /// The noise whose zeros are the sulci: two lattices at an angle, so that neither is visible.
    fn folds(&self, place: DVec3) -> (f64, DVec3) {
        let scale = 1.0 / (1.5 * self.spacing);
        let (one, one_slope) = noise(1, place * scale);
        // A rotation matrix with rational entries.
        let turn = glam::DMat3::from_cols(
            DVec3::new(2.0, 1.0, -2.0) / 3.0,
            DVec3::new(-2.0, 2.0, -1.0) / 3.0,
            DVec3::new(1.0, 2.0, 2.0) / 3.0,
        );
        let (two, two_slope) = noise(2, turn * place * scale);
        (one + two, (one_slope + turn.transpose() * two_slope) * scale)
    }
}

impl Surface for Cortex {
    /// Projects from the centre, so that triangles that do not overlap as seen from it never intersect.
    fn project(&self, point: DVec3) -> (DVec3, DVec3) {
        let direction = point.normalize();
        (direction * self.radius(direction), direction)
    }

    /// Alignment with the direction from the centre instead of the normals: if it is positive everywhere, the surface
    /// cannot cut itself.
    fn alignment(&self, corners: [DVec3; 3], directions: [DVec3; 3]) -> f64 {
        area_vector(corners).normalize_or_zero().dot(directions[0])
    }

    const PROJECTS_TO_NORMALS: bool = false;

    /// The walls of the sulci have a slope of about 4: 4 mm of depth for 1 mm of width.
    const LEAST_ALIGNMENT: f64 = 0.08;
}

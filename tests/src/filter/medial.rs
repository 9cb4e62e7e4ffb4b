//! Points of the medial axis of a surface, where the closest point jumps.

use glam::{DVec3, Vec3};

use crate::oracle::{Instrument, exhaustive};

/// Radius (mm) of the largest balls.
const LARGEST: f64 = 40.0;

/// The centre of the largest ball that touches a surface at its point closest to `near` and holds no point of it: it
/// touches the surface once more. `None` where that ball is larger than a walk's region.
///
/// A ball shrinks until it holds no point of the surface (Ma, Bae & Choi 2012).
#[must_use]
pub fn medial_centre(rows: &[Vec3], triangles: &[[u32; 3]], near: Vec3) -> Option<Vec3> {
    let closest = |at: DVec3| {
        exhaustive(rows, triangles, &Instrument::sphere(at.as_vec3(), 0.0))
            .map(|pair| pair.on_surface)
    };
    let touch = closest(near.as_dvec3())?;
    let normal = (near.as_dvec3() - touch).try_normalize()?;
    let mut radius = LARGEST;
    for _ in 0..40 {
        let to = closest(touch + normal * radius)? - touch;
        let height = normal.dot(to);
        let smaller = to.length_squared() / (2.0 * height);
        if !(height > 0.0 && smaller < radius * (1.0 - 1e-6)) {
            break;
        }
        radius = smaller;
    }
    (radius < LARGEST).then(|| (touch + normal * radius).as_vec3())
}

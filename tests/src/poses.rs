//! Tool poses around a surface: ordinary and adversarial ones.

use fastrand::Rng;
use glam::Vec3;

use crate::deform::unit;
use crate::oracle::Instrument;

/// A random tool, a sphere or a capsule: near the surface, on it, in it or far from it.
#[must_use]
pub fn pose(positions: &[Vec3], triangles: &[[u32; 3]], rng: &mut Rng) -> Instrument {
    let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let (middle, size) = ((low + high) / 2.0, (high - low).length().max(1e-3));
    let corners = triangles[rng.usize(..triangles.len())].map(|v| positions[v as usize]);
    let on_surface = {
        let (a, b) = (rng.f32(), rng.f32());
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        corners[0] + (corners[1] - corners[0]) * a + (corners[2] - corners[0]) * b
    };
    let centre = match rng.u32(..8) {
        0 => corners[0],
        1 => (corners[0] + corners[1]) / 2.0,
        2 => on_surface,
        // At the middle of a round surface many distances are equal.
        3 => middle,
        4 => middle + (on_surface - middle) * rng.f32(),
        5 => middle + unit(rng) * size * 20.0,
        _ => on_surface + unit(rng) * size * 0.4 * rng.f32(),
    };
    let radius = if rng.u32(..5) == 0 { 0.0 } else { size * 0.05 * rng.f32() };
    if rng.bool() {
        return Instrument::sphere(centre, radius);
    }
    let half = match rng.u32(..8) {
        0 => Vec3::ZERO,
        1 => (corners[1] - corners[0]) / 2.0,
        2 => unit(rng) * size * 3.0,
        3 => unit(rng) * size * 1e-6,
        _ => unit(rng) * size * 0.3 * rng.f32(),
    };
    Instrument::capsule(centre - half, centre + half, radius)
}

//! Surfaces and tools for what a tick seldom does: many triangles are equally close, two planes disagree about the
//! side, or an axis is equally deep in many places.

// Requirement: A-06

use dibs_build::Mesh;
use dibs_tests::deform::unit;
use dibs_tests::surfaces::ball;
use fastrand::Rng;
use glam::Vec3;

/// Half the length of each surface, which is along z around the origin.
const HALF: f32 = 40.0;
const RADIUS: f32 = 10.0;
const RINGS: u32 = 17;
/// Ticks in a row with the same tool.
const HELD: u32 = 3;

/// A square bar, whose faces are flat and equally far from its axis; a string of beads, which is equally deep in each;
/// and a diamond, at whose corners opposite faces are more than a right angle apart.
pub fn surfaces() -> [Mesh; 3] {
    let mut diamond = ball(0);
    for at in &mut diamond.positions {
        *at = at.normalize() * Vec3::new(RADIUS, RADIUS, HALF);
    }
    [bar(|_| RADIUS), bar(|ring| RADIUS * if ring % 2 == 0 { 0.6 } else { 1.0 }), diamond]
}

/// A closed bar of square rings of this radius.
fn bar(radius: impl Fn(u32) -> f32) -> Mesh {
    let height = |ring: u32| HALF * (2.0 * ring as f32 / (RINGS - 1) as f32 - 1.0);
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let square = |ring: u32| {
        let radius = radius(ring);
        corners.map(|(x, y)| Vec3::new(radius * x, radius * y, height(ring)))
    };
    let mut positions: Vec<Vec3> = (0..RINGS).flat_map(square).collect();
    let [low, high] = [positions.len() as u32, positions.len() as u32 + 1];
    positions.extend([Vec3::Z * -HALF, Vec3::Z * HALF]);
    let mut triangles = Vec::new();
    for (side, next) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
        let last = 4 * (RINGS - 1);
        triangles.extend([[low, next, side], [high, last + side, last + next]]);
        for first in (0..last).step_by(4) {
            let [a, b, c, d] = [side, next, side + 4, next + 4].map(|corner| first + corner);
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Start and span of an axis, and a budget, for the tick of this number on a surface with so many vertices, whose
/// positions `vertex` gives.
pub fn tool(
    number: u32,
    count: usize,
    vertex: impl Fn(usize) -> Vec3,
    rng: &mut Rng,
) -> (Vec3, Vec3, u32) {
    let other = vertex(rng.usize(..count));
    let vertex = vertex(7 * (number / HELD) as usize % count);
    let along = Vec3::Z * 1.5 * HALF;
    let beside = |by: f32| Vec3::new(by * vertex.x, 0.25 * vertex.y, -0.75 * HALF);
    let off = (other.normalize() + unit(rng)).normalize() * 10_f32.powf(6.0 * rng.f32() - 5.0);
    let (start, span) = match number / HELD % 8 {
        // On axes of symmetry, and in the middle.
        0 => (Vec3::Z * -0.75 * HALF, along),
        1 => (Vec3::X * -2.0 * RADIUS, Vec3::X * 4.0 * RADIUS),
        2 => (Vec3::ZERO, Vec3::Z * 1e-3),
        // In a face, outside of it and inside.
        3 => (beside(1.0), along),
        4 => (beside(1.5), along),
        5 => (beside(0.5), along),
        // On a vertex, and next to it.
        6 => (vertex, vertex.normalize() * RADIUS),
        _ => (other + off, off.normalize() * RADIUS),
    };
    // Too little twice in a row, before or after enough.
    let is_enough = number % HELD == number / HELD / 8 % 2 * (HELD - 1);
    (start, span, if is_enough { 1 << 14 } else { 1 + rng.u32(..400) })
}

//! An instrument that hovers over a surface, touches it, passes through its wall, lies along it and moves fast; and one
//! that is pushed through a whole organ, then a short one within its wall.

use dibs_nostd::Capsule;
use glam::Vec3;

/// The instrument's radius and length (mm).
pub const RADIUS: f32 = 2.5;
const LENGTH: f32 = 120.0;

/// The instrument's motion, each for a fifth of the path.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Hovers,
    Touches,
    Passes,
    LiesAlong,
    Hurries,
}

const PHASES: [Phase; 5] =
    [Phase::Hovers, Phase::Touches, Phase::Passes, Phase::LiesAlong, Phase::Hurries];

/// The radius and length (mm) of an instrument that fits in a heart's wall.
const SHORT: [f32; 2] = [1.0, 6.0];

/// The poses of a path around a point that the surface surrounds, with this many ticks, at a multiple of the usual speed.
pub fn path(corners: &[[Vec3; 3]], (middle, faster): (Vec3, f32), ticks: usize) -> Vec<Capsule> {
    let (mut looked, mut wall) = (Vec3::ZERO, 0.0);
    let poses = (0..ticks).map(|tick| {
        let time = tick as f32 * 0.001 * faster;
        let phase = PHASES[(tick * PHASES.len() / ticks).min(PHASES.len() - 1)];
        let speed = if phase == Phase::Hurries { 2.0 } else { 0.5 };
        let (around, up) = (speed * time, 0.7 + 0.4 * (0.37 * speed * time).sin());
        let out = Vec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin());
        if out.distance(looked) > 0.003 {
            (looked, wall) = (out, last_walls(corners, middle, out)[1]);
        }
        let height = match phase {
            Phase::Hovers => 5.5 + 3.0 * (2.1 * time).sin(),
            Phase::Touches => 1.5 + 3.0 * (3.1 * time).sin(),
            Phase::Passes => -12.0 + 18.0 * (1.3 * time).sin(),
            Phase::LiesAlong => 2.0 + 2.0 * time.sin(),
            Phase::Hurries => -5.0 + 15.0 * (5.3 * time).sin(),
        };
        let tip = middle + out * (wall + height + RADIUS);
        let pivot = match phase {
            Phase::LiesAlong => tip + out.any_orthonormal_vector() * 100.0 + out * 12.0,
            _ => middle + Vec3::new(20.0, 10.0, 220.0),
        };
        let end = tip + (pivot - tip).normalize() * LENGTH;
        Capsule::new(tip, end, RADIUS).expect("finite")
    });
    poses.collect()
}

/// The poses of a shaft through everything around a point, for half of the path, and of a short instrument within
/// the outermost wall, for the other half.
pub fn through(corners: &[[Vec3; 3]], middle: Vec3, ticks: usize) -> Vec<Capsule> {
    let (mut looked, mut walls) = (Vec3::ZERO, [0.0; 2]);
    let poses = (0..ticks).map(|tick| {
        let time = tick as f32 * 0.001;
        let (around, up) = (0.5 * time, 0.7 + 0.4 * (0.2 * time).sin());
        let out = Vec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin());
        if out.distance(looked) > 0.003 {
            (looked, walls) = (out, last_walls(corners, middle, out));
        }
        if tick < ticks / 2 {
            let tip = middle + out * (walls[1] + 8.0 + 6.0 * (1.3 * time).sin());
            return Capsule::new(tip, tip - out * LENGTH, RADIUS).expect("finite");
        }
        let [radius, length] = SHORT;
        let centre = middle + out * (walls[0].midpoint(walls[1]) + (1.7 * time).sin());
        let half = out.any_orthonormal_vector() * length / 2.0;
        Capsule::new(centre - half, centre + half, radius).expect("finite")
    });
    poses.collect()
}

/// The last two intersections of a ray with a surface, by their distances from the ray's start.
fn last_walls(corners: &[[Vec3; 3]], from: Vec3, along: Vec3) -> [f32; 2] {
    let crossings = corners.iter().filter_map(|&[a, b, c]| {
        // Möller and Trumbore (1997).
        let (ab, ac) = (b - a, c - a);
        let across = along.cross(ac);
        let volume = ab.dot(across);
        let away = from - a;
        let u = away.dot(across) / volume;
        let v = along.dot(away.cross(ab)) / volume;
        let far = ac.dot(away.cross(ab)) / volume;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(far)
    });
    crossings.fold(
        [0.0; 2],
        |[before, last], far| {
            if far > last { [last, far] } else { [f32::max(before, far), last] }
        },
    )
}

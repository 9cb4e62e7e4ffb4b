//! An instrument that hovers over a surface, touches it, passes through its wall, lies along it and moves fast.

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

/// The poses of a path around a point inside the surface, with this many ticks, at a multiple of the usual speed.
pub fn path(corners: &[[Vec3; 3]], (middle, faster): (Vec3, f32), ticks: usize) -> Vec<Capsule> {
    let (mut looked, mut wall) = (Vec3::ZERO, 0.0);
    let poses = (0..ticks).map(|tick| {
        let time = tick as f32 * 0.001 * faster;
        let phase = PHASES[(tick * PHASES.len() / ticks).min(PHASES.len() - 1)];
        let speed = if phase == Phase::Hurries { 2.0 } else { 0.5 };
        let (around, up) = (speed * time, 0.7 + 0.4 * (0.37 * speed * time).sin());
        let out = Vec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin());
        if out.distance(looked) > 0.003 {
            (looked, wall) = (out, farthest(corners, middle, out));
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

/// The farthest intersection of a ray with a surface: its distance from the ray's start.
fn farthest(corners: &[[Vec3; 3]], from: Vec3, along: Vec3) -> f32 {
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
    crossings.fold(0.0, f32::max)
}

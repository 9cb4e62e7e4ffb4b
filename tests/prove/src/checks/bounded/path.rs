//! An instrument that hovers over a surface, touches it, passes through its wall, lies along it and moves fast; and one
//! that is pushed through a whole organ, then a short one wholly inside its wall.

use dibs_nostd::Capsule;
use glam::{FloatExt, Vec3};

/// Ticks for each frame of the surface's motion: 25 frames a second.
const TICKS_A_FRAME: usize = 40;

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

/// How far (mm) it is below the wall's outer face: near the middle, and at every tick wholly inside.
const BELOW: f32 = 4.0;

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
            (looked, wall) = (out, last_wall(corners, middle, out));
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
/// the outermost wall, which it follows from frame to frame, for the other half.
pub fn through(frames: &[Vec<[Vec3; 3]>], middle: Vec3, ticks: usize) -> Vec<Capsule> {
    let (mut cast, mut walls) = ((0, Vec3::ZERO), [0.0; 2]);
    let poses = (0..ticks).map(|tick| {
        let time = tick as f32 * 0.001;
        let (around, up) = (0.5 * time, 0.7 + 0.4 * (0.2 * time).sin());
        let out = Vec3::new(around.cos() * up.cos(), around.sin() * up.cos(), up.sin());
        let (frame, t) = place(tick);
        if frame != cast.0 || out.distance(cast.1) > 0.003 {
            cast = (frame, out);
            let wall_in = |frame: usize| last_wall(&frames[frame % frames.len()], middle, out);
            walls = [frame, frame + 1].map(wall_in);
        }
        let wall = walls[0].lerp(walls[1], t);
        if tick < ticks / 2 {
            let tip = middle + out * (wall + 8.0 + 6.0 * (1.3 * time).sin());
            return Capsule::new(tip, tip - out * LENGTH, RADIUS).expect("finite");
        }
        let [radius, length] = SHORT;
        let centre = middle + out * (wall - BELOW + (1.7 * time).sin());
        let half = out.any_orthonormal_vector() * length / 2.0;
        Capsule::new(centre - half, centre + half, radius).expect("finite")
    });
    poses.collect()
}

/// A tick's frame, and the fraction of the interval to the next frame.
pub fn place(tick: usize) -> (usize, f32) {
    (tick / TICKS_A_FRAME, (tick % TICKS_A_FRAME) as f32 / TICKS_A_FRAME as f32)
}

/// The last intersection of a ray with a surface, by its distance from the ray's start.
fn last_wall(corners: &[[Vec3; 3]], from: Vec3, along: Vec3) -> f32 {
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

//! Motions richer than the generated heart's.

use std::f32::consts::TAU;

use dibs_build::{Mesh, Motion, generate};
use fastrand::Rng;
use glam::Vec3;

/// A heart that beats while waves travel over it: a motion with two modes a wave, plus at least the beat's two.
///
/// # Panics
/// If no heart has so many triangles.
#[must_use]
pub fn trembling(triangles: u32, waves: usize, seed: u64) -> (Mesh, Motion) {
    let generate::MovingMesh { mesh, mut motion } =
        generate::heart(triangles).expect("a valid size");
    let mut rng = Rng::with_seed(seed);
    let mut vector = |size: f32| Vec3::from([(); 3].map(|()| (rng.f32() - 0.5) * size));
    let waves: Vec<[Vec3; 2]> = (0..waves).map(|_| [vector(0.12), vector(1.0)]).collect();
    let frames = motion.frames.len() as f32;
    for (time, frame) in motion.frames.iter_mut().enumerate() {
        for (position, rest) in frame.iter_mut().zip(&mesh.positions) {
            for (number, [wave, size]) in (1..).zip(&waves) {
                let (phase, turn) = (wave.dot(*rest), TAU * (number * time) as f32 / frames);
                *position += *size * ((phase + turn).sin() - phase.sin());
            }
        }
    }
    (mesh, motion)
}

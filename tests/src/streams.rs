//! The benchmark's seeded streams: deformed surfaces with tools around them, one that pulses, and the beating heart.

use std::f32::consts::TAU;

use dibs_build::Motion;
use dibs_nostd::{Capsule, Sphere};
use fastrand::Rng;
use glam::{Quat, Vec3};

use crate::deform::unit;
use crate::method::Probe;

/// Radius of the spheres, in mm.
pub const SPHERE_RADIUS: f32 = 3.0;
/// Radius of the capsules, in mm.
pub const CAPSULE_RADIUS: f32 = 2.5;
/// Length of the capsules' axes, in mm.
pub const CAPSULE_LENGTH: f32 = 60.0;

/// Independent random deformations of one surface, each with a sphere and a capsule near it.
///
/// A deformation is the paper's: every axis scaled independently, long waves over the whole surface, one local bump,
/// and a rotation. Its stretch is not limited here; the user of a frame checks it.
///
/// A tool's distance from a random vertex is drawn so that separations on a brain are distributed as in the paper.
pub struct Stream<'m> {
    rest: &'m [Vec3],
    middle: Vec3,
    size: f32,
    rng: Rng,
}

impl<'m> Stream<'m> {
    /// A stream of frames of the surface with these positions at rest.
    #[must_use]
    pub fn new(rest: &'m [Vec3], seed: u64) -> Self {
        let low = rest.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = rest.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let (middle, size) = ((low + high) / 2.0, (high - low).length());
        Self { rest, middle, size, rng: Rng::with_seed(seed) }
    }

    /// The next frame, as positions in the mesh's order.
    pub fn deform(&mut self, positions: &mut Vec<Vec3>) {
        let (rng, middle, size) = (&mut self.rng, self.middle, self.size);
        let scale = Vec3::ONE + signed(rng) * 0.06;
        let waves: [Wave; 3] = std::array::from_fn(|_| Wave::new(rng, size));
        let bump = self.rest[rng.usize(..self.rest.len())] - middle;
        let height = unit(rng) * size * 0.016 * rng.f32();
        let narrow = 1.0 / (size * 0.24);
        let turn = glam::Mat3::from_quat(Quat::from_axis_angle(unit(rng), rng.f32() * TAU));
        positions.clear();
        positions.extend(self.rest.iter().map(|&p| {
            let p = p - middle;
            let mut moved = p * scale;
            for wave in &waves {
                moved += wave.push * smooth_wave(p.dot(wave.along) + wave.phase);
            }
            let near = 1.0 - ((p - bump) * narrow).length_squared();
            let near = near.max(0.0);
            moved += height * (near * near);
            turn * moved
        }));
    }

    /// A sphere and a capsule near the current surface.
    pub fn tools(&mut self, positions: &[Vec3]) -> [Probe; 2] {
        let rng = &mut self.rng;
        let scale = self.size / 240.0;
        let mut near = |nearest: f32, farthest: f32| {
            let from = positions[rng.usize(..positions.len())];
            // Away from the middle of the surface rather than into it.
            let outwards = unit(rng) + from.normalize_or_zero() * 0.8;
            from + outwards.normalize_or(Vec3::X)
                * (nearest + (farthest - nearest) * rng.f32())
                * scale
        };
        let (centre, middle) = (near(5.0, 130.0), near(5.0, 145.0));
        let half = unit(rng) * CAPSULE_LENGTH / 2.0;
        let sphere = Sphere::new(centre, SPHERE_RADIUS);
        let capsule = Capsule::new(middle - half, middle + half, CAPSULE_RADIUS);
        [
            Probe::Sphere(sphere.expect("a valid sphere")),
            Probe::Capsule(capsule.expect("a valid capsule")),
        ]
    }
}

/// A surface with long waves that travel over it, as the heartbeat and breathing move a brain.
///
/// The waves are as high and as long as those of a [`Stream`]'s frames.
pub struct Pulse<'m> {
    rest: &'m [Vec3],
    middle: Vec3,
    waves: [Wave; 3],
}

/// Frequency (Hz) of each wave: heartbeat, breathing, and one between them.
const PULSES: [f32; 3] = [1.0, 0.25, 0.6];

impl<'m> Pulse<'m> {
    /// A surface with these positions at rest.
    #[must_use]
    pub fn new(rest: &'m [Vec3], seed: u64) -> Self {
        let low = rest.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = rest.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let mut rng = Rng::with_seed(seed);
        let waves = std::array::from_fn(|_| Wave::new(&mut rng, (high - low).length()));
        Self { rest, middle: (low + high) / 2.0, waves }
    }

    /// The positions at this time (s).
    pub fn deform(&self, seconds: f32, positions: &mut Vec<Vec3>) {
        positions.clear();
        positions.extend(self.rest.iter().map(|&rest| {
            let from_middle = rest - self.middle;
            self.waves.iter().zip(PULSES).fold(rest, |moved, (wave, pulse)| {
                let turns = from_middle.dot(wave.along) + wave.phase + pulse * seconds;
                moved + wave.push * smooth_wave(turns)
            })
        }));
    }
}

struct Wave {
    along: Vec3,
    push: Vec3,
    phase: f32,
}

impl Wave {
    /// A wave over a surface whose diagonal is `size`. Wave vectors are in turns a mm: the shortest wave is slightly
    /// shorter than a third of the diagonal.
    fn new(rng: &mut Rng, size: f32) -> Self {
        Self {
            along: unit(rng) * unit(rng) * (20.0 / TAU / size),
            push: unit(rng) * size * 0.009,
            phase: rng.f32(),
        }
    }
}

fn signed(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0
}

/// A smooth wave of period and height 1, made of parabolas, because sines would dominate the run time.
fn smooth_wave(turns: f32) -> f32 {
    // Adding and subtracting 1.5 * 2^23 rounds to the nearest whole turn, up to 2^22 turns.
    const ROUND: f32 = 12_582_912.0;
    let t = turns - ((turns + ROUND) - ROUND);
    t * (8.0 - 16.0 * t.abs())
}

/// Ticks a second of a control loop.
pub const TICK_RATE: f32 = 1_000.0;

/// A recorded motion at its recorded speed, sampled at every tick of a control loop.
pub struct Beat<'m> {
    motion: &'m Motion,
    middle: Vec3,
    /// Half the longest side of the surface at rest.
    reach: f32,
}

impl<'m> Beat<'m> {
    /// Repeats a motion.
    ///
    /// # Panics
    /// If it has no frame.
    #[must_use]
    pub fn new(motion: &'m Motion) -> Self {
        let rest = &motion.frames[0];
        let low = rest.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = rest.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let middle = (low + high) / 2.0;
        let reach = (high - low).max_element() / 2.0;
        Self { motion, middle, reach }
    }

    /// The positions at a tick, interpolated between the two frames around it.
    pub fn deform(&self, tick: u32, positions: &mut Vec<Vec3>) {
        self.deform_at(tick as f32 / TICK_RATE, positions);
    }

    /// The same at this time (s).
    pub fn deform_at(&self, seconds: f32, positions: &mut Vec<Vec3>) {
        let rate = if self.motion.rate > 0.0 { self.motion.rate } else { 25.0 };
        let frames = &self.motion.frames;
        let time = (seconds * rate).rem_euclid(frames.len() as f32);
        let first = time as usize % frames.len();
        let second = (first + 1) % frames.len();
        let share = time - time.floor();
        positions.clear();
        positions
            .extend(frames[first].iter().zip(&frames[second]).map(|(&a, &b)| a + (b - a) * share));
    }

    /// The instrument at a tick: a capsule that enters through a fixed port, as in keyhole surgery, while its tip moves
    /// around the surface and, every seven seconds, through its middle. The motion is the sum of a few slow sines and a
    /// physiological tremor, the same as in `firmware-example`.
    ///
    /// # Panics
    /// Never for finite frames.
    #[must_use]
    pub fn tool(&self, tick: u32) -> Probe {
        let wave = |period: u32, phase: f32| {
            (TAU * ((tick % period) as f32 / period as f32 + phase)).sin()
        };
        let distance = self.reach * (0.75 + 0.75 * wave(7_000, 0.25));
        let around = Vec3::new(wave(11_000, 0.25), wave(11_000, 0.0), 0.6 * wave(5_300, 0.1));
        let tremor = Vec3::new(wave(111, 0.0), wave(113, 0.3), wave(109, 0.7)) * 0.1;
        let tip = self.middle + around * distance + tremor;
        let port = self.middle + Vec3::new(0.3, -0.4, 2.0) * self.reach;
        let end = tip + (port - tip).normalize() * CAPSULE_LENGTH;
        Probe::Capsule(Capsule::new(tip, end, CAPSULE_RADIUS).expect("a valid capsule"))
    }
}

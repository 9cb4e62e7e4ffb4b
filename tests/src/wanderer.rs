//! A chain of tools on a random walk.

use dibs_nostd::Capsule;
use fastrand::Rng;
use glam::Vec3;

use crate::deform::unit;

/// A chain of eight capsules that bends on a random walk through two hearts beside each other.
pub struct Wanderer {
    joints: [Vec3; 9],
    rng: Rng,
    time: f32,
}

impl Wanderer {
    /// A straight chain above the hearts.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let joints = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|at| Vec3::new(14.0 * at as f32, 80.0, 30.0));
        Self { joints, rng: Rng::with_seed(seed), time: 0.0 }
    }

    /// Usually steps, sometimes rests or leaps. Returns the capsules.
    ///
    /// # Panics
    /// Never: its joints stay finite.
    pub fn step(&mut self) -> [Capsule; 8] {
        let rng = &mut self.rng;
        let far = match rng.u32(..200) {
            0 => 60.0,
            1..20 => 0.0,
            _ => 0.4,
        };
        self.time += 0.002;
        let wave = |rate: f32, size: f32| size * (rate * self.time).sin();
        let goal = Vec3::new(85.0 + wave(1.0, 120.0), wave(1.7, 60.0), 30.0 + wave(2.3, 60.0));
        let centre = self.joints.iter().sum::<Vec3>() / 9.0;
        let all = far * ((goal - centre).normalize_or_zero() + 0.3 * unit(rng));
        for joint in &mut self.joints {
            *joint += all + 0.1 * far.min(1.0) * unit(rng);
        }
        let joints = self.joints;
        [0, 1, 2, 3, 4, 5, 6, 7]
            .map(|at| Capsule::new(joints[at], joints[at + 1], 2.0).expect("finite"))
    }
}

//! The demo's hand: a mass with a damper, for any surface.

use dibs_nostd::glam::Vec3;

/// A surgeon's hand with the instrument in it: 200 g, damped by 20 N s/m.
#[derive(Clone, Copy, Debug)]
pub struct Hand {
    /// The instrument's tip (mm).
    pub at: Vec3,
    /// Its velocity (mm/s).
    pub velocity: Vec3,
}

impl Hand {
    /// The most that it pushes with (N): nine tenths of the wall's largest force.
    pub const PUSH: f32 = 0.9 * crate::MAX_FORCE;

    /// N s^2/mm.
    const MASS: f32 = 2e-4;

    /// N s/mm.
    const DAMPER: f32 = 0.02;

    /// A hand at rest.
    #[must_use]
    pub const fn new(at: Vec3) -> Self {
        Self { at, velocity: Vec3::ZERO }
    }

    /// The velocity (mm/s) that a push (N) leads to where nothing resists.
    #[must_use]
    pub fn free(push: Vec3) -> Vec3 {
        push * (1.0 / Self::DAMPER)
    }

    /// Pushes for a period (s) against a force (N).
    pub fn push(&mut self, push: Vec3, force: Vec3, period: f32) {
        self.velocity += (force + push - self.velocity * Self::DAMPER) * (period / Self::MASS);
        self.at += self.velocity * period;
    }
}

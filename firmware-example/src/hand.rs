//! A simulated hand: a mass with a damper, for any surface.

use dibs_nostd::glam::Vec3;

/// A surgeon's hand that holds the instrument: 200 g, damped by 20 N s/m.
#[derive(Clone, Copy, Debug)]
pub struct Hand {
    /// The instrument's tip (mm).
    pub at: Vec3,
    /// Its velocity (mm/s).
    pub velocity: Vec3,
}

impl Hand {
    /// Largest force of its push (N): nine tenths of the wall's largest force.
    pub const PUSH: f32 = 0.9 * crate::MAX_FORCE;

    /// Its mass (N s^2/mm).
    const MASS: f32 = 2e-4;

    /// Its damping (N s/mm).
    const DAMPER: f32 = 0.02;

    /// A hand at rest.
    #[must_use]
    pub const fn new(at: Vec3) -> Self {
        Self { at, velocity: Vec3::ZERO }
    }

    /// The final velocity (mm/s) of a push (N) without resistance.
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

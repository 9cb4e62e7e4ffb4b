//! An instrument that a simulated hand pushes against the surface: alternately against the wall's force, and by
//! commands that a filter admits. It runs with the controller, so that the loop is closed in every tick and a run is
//! reproducible bit for bit.

use bytemuck::Zeroable;
use dibs_nostd::constraint::{ConstraintForce, EnergyAccount};
use dibs_nostd::failsafe::State;
use dibs_nostd::filter::{AdmittedMotion, FilterError, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::Answer;
use dibs_nostd::{Capsule, ToolError};

use crate::hand::Hand;
use crate::instrument::{LENGTH, RADIUS};
use crate::robot::Robot;
use crate::surface::{CENTRE, REACH};
use crate::telemetry::Push;
use crate::{PERIOD, SPRING};

/// Limits of the wall: the energy (mJ) that it may give to the hand, the largest step of its force (N) from tick to tick,
/// and the largest speed (mm/s) of the instrument relative to it.
pub const ACCOUNT: EnergyAccount = match EnergyAccount::new(1.0, 0.5, &SPRING, 300.0) {
    Ok(account) => account,
    Err(_) => panic!("a constant is out of range"),
};

/// Ticks from one push to the next, and ticks of these in which the hand pushes; in the others it draws back.
const CYCLE: u32 = 1_000;
const INTO: u32 = 700;

/// Stiffness of the hand's arm (N/mm): it pushes towards a point, with at most [`Hand::PUSH`].
const ARM: f32 = 1.0;

/// Angle between two starting points, in radians: about the golden angle, so that they never repeat.
const ANGLE: f32 = 2.4;

/// The instrument and the hand.
pub struct PushedRobot {
    hand: Hand,
    /// Vector from the tip to the other end (mm).
    shaft: Vec3,
    /// Number of ticks in which the surface was trusted, and whether it was in the last one: otherwise the hand lets
    /// go.
    ticks: u32,
    is_trusted: bool,
    /// Starting point of this push.
    place: Vec3,
    account: EnergyAccount,
    record: Push,
}

impl PushedRobot {
    /// The instrument outside the surface, in a hand that waits for the surface.
    #[must_use]
    #[expect(clippy::new_without_default, reason = "there is no usual robot")]
    pub fn new() -> Self {
        let place = place(0);
        Self {
            hand: Hand::new(place),
            shaft: Vec3::new(0.14, -0.19, 0.97) * LENGTH,
            ticks: 0,
            is_trusted: false,
            place,
            account: ACCOUNT,
            record: Push { kind: Push::KIND, ..Push::zeroed() },
        }
    }

    /// The force of the hand's push (N).
    fn wanted(&self) -> Vec3 {
        if !self.is_trusted {
            return Vec3::ZERO;
        }
        let goal = if self.ticks % CYCLE < INTO { CENTRE } else { self.place };
        let push = (goal - self.hand.at) * ARM;
        let size = libm::sqrtf(push.length_squared());
        if size > Hand::PUSH { push * (Hand::PUSH / size) } else { push }
    }

    /// Ends a tick.
    fn next(&mut self, answer: &Answer, push: Vec3) {
        let record = &mut self.record;
        record.push = push.to_array();
        record.commanded = Hand::free(push).to_array();
        record.moved = self.hand.velocity.to_array();
        record.velocity = answer.velocity.to_array();
        record.is_inwards = u32::from(self.ticks % CYCLE < INTO);
        self.is_trusted = answer.trust.state != State::Safe;
        if self.is_trusted {
            self.ticks = self.ticks.wrapping_add(1);
            if self.ticks.is_multiple_of(CYCLE) {
                self.place = place(self.ticks / CYCLE);
            }
        }
    }
}

/// A starting point of a push: one and a half times as far from the centre as the surface.
fn place(number: u32) -> Vec3 {
    let angle = ANGLE * (number % 1_000) as f32;
    CENTRE + Vec3::new(0.9 * libm::cosf(angle), 0.9 * libm::sinf(angle), 1.2) * REACH
}

impl Robot for PushedRobot {
    fn instrument(&self, _: u32) -> Result<Capsule, ToolError> {
        Capsule::new(self.hand.at, self.hand.at + self.shaft, RADIUS)
    }

    /// The commanded motion, in every other cycle.
    fn command(&self) -> Option<RigidMotion> {
        let velocity = Hand::free(self.wanted());
        let motion = RigidMotion::new(self.hand.at, velocity * PERIOD, Vec3::ZERO);
        (self.ticks / CYCLE % 2 == 1).then_some(motion)
    }

    fn apply(&mut self, answer: &Answer, force: &ConstraintForce) -> Vec3 {
        let push = self.wanted();
        let force = self.account.pass(force.force, answer.velocity, PERIOD);
        self.hand.push(push, force, PERIOD);
        self.record.outcome = 0;
        self.record.balance = self.account.balance();
        self.next(answer, push);
        force
    }

    fn execute(&mut self, answer: &Answer, admitted: &Result<AdmittedMotion, FilterError>) {
        let push = self.wanted();
        let at = self.hand.at;
        if let Ok(AdmittedMotion { motion, .. }) = admitted {
            let end = motion.apply(at + self.shaft);
            self.hand.at = motion.apply(at);
            self.shaft = end - self.hand.at;
        }
        self.hand.velocity = (self.hand.at - at) * (1.0 / PERIOD);
        // No force acts, so the last one does no work.
        let _ = self.account.pass(Vec3::ZERO, Vec3::ZERO, PERIOD);
        self.record.filtered(admitted);
        self.next(answer, push);
    }

    fn push(&self) -> Option<Push> {
        Some(self.record)
    }
}

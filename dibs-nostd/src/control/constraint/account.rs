//! An account of the energy that a wall gives, and a limit on the force's steps.

// Requirement: C-04

use glam::Vec3;

use super::{GainError, positive};
use crate::math::sqrt::sqrt;

/// Keeps an account of the energy that a wall's force gives to the hand, relative to the wall, and reduces the force
/// where the energy given would exceed the energy received by more than a stated tank.
///
/// A spring in continuous time returns the energy that it received. Sampling, a frame that moves the wall in one tick,
/// the end of a hold and a saturation that yields give more. The account sums force times relative velocity (a
/// passivity observer: Hannaford & Ryu, IEEE T-RA 2002) and removes from the force the part along an outward motion
/// that the account does not cover. A force against an inward motion is never reduced. The energy received from the
/// hand is limited to the spring's own, so that a damper does not fill the account.
///
/// Between two ticks the force changes by at most a largest step, also where the account requires more: if the relative
/// velocity leaps outwards at a large force, the account is overdrawn until the force has fallen.
///
/// ```
/// use dibs_nostd::constraint::EnergyAccount;
/// use dibs_nostd::glam::Vec3;
///
/// let mut account = EnergyAccount::new(1.0, 0.5, 1.0)?; // mJ, N a tick, N/mm
/// // A new frame puts the wall 5 mm over the instrument: the force comes in steps.
/// let force = account.pass(Vec3::X * 5.0, Vec3::ZERO, 0.001);
/// assert!((force.x - 0.5).abs() < 1e-6 && force.x <= 0.5);
/// # Ok::<(), dibs_nostd::constraint::GainError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EnergyAccount {
    /// N mm, that is mJ.
    tank: f32,
    /// N.
    step: f32,
    /// N/mm.
    stiffness: f32,
    /// mJ that may still be given.
    balance: f32,
    /// The last force (N).
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    force: Vec3,
}

/// The fraction of the balance that a tick may give: as the balance runs out, the force falls by this fraction of
/// itself per tick.
const PART: f32 = 1.0 / 16.0;

impl EnergyAccount {
    /// An account with a full tank (mJ), for forces that change by at most `step` (N) per tick, of a wall with this
    /// stiffness (N/mm).
    ///
    /// # Errors
    /// [`GainError`] names the number that is not above 0 and finite.
    pub const fn new(tank: f32, step: f32, stiffness: f32) -> Result<Self, GainError> {
        let tank = tri!(positive("tank", tank));
        let step = tri!(positive("step", step));
        let stiffness = tri!(positive("stiffness", stiffness));
        Ok(Self { tank, step, stiffness, balance: tank, force: Vec3::ZERO })
    }

    /// The energy (mJ) that may still be given. Below 0 after a tick whose motion took more than predicted from the
    /// last one.
    #[must_use]
    pub const fn balance(&self) -> f32 {
        self.balance
    }

    /// The force to apply for the next period (s), for the `force` computed by a constraint.
    ///
    /// `velocity` (mm/s) is the tool's relative to the wall since the last tick, as for the constraint. If an input is
    /// not finite, the force falls to zero in steps.
    ///
    /// Cost: some 60 f32 operations and two roots.
    #[must_use]
    pub fn pass(&mut self, force: Vec3, velocity: Vec3, period: f32) -> Vec3 {
        let moved = velocity * period;
        let is_known = force.is_finite() && moved.is_finite();
        let (wanted, moved) = if is_known { (force, moved) } else { (Vec3::ZERO, Vec3::ZERO) };
        // The last force's work.
        let balance = self.balance - self.force.dot(moved);
        let most = self.tank + wanted.length_squared() / (2.0 * self.stiffness);
        // Written so that NaN empties the account.
        self.balance = if balance < most {
            balance
        } else if balance >= most {
            most
        } else {
            0.0
        };
        let mut next = wanted;
        let given = next.dot(moved);
        let covered = if self.balance > 0.0 { self.balance * PART } else { 0.0 };
        if given > covered {
            next -= moved * ((given - covered) / moved.length_squared());
        }
        let change = next - self.force;
        let size = sqrt(change.length_squared());
        if size > self.step {
            next = self.force + change * (self.step / size * (1.0 - 4.0 * f32::EPSILON));
        }
        self.force = if next.is_finite() { next } else { Vec3::ZERO };
        self.force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
    use crate::query::{Proximity, Side};
    use crate::unavailable::Unavailable;

    const TICK: f32 = 0.001;

    /// The most energy given to a hand of 200 g, and the largest step of the force, in 10 s at a wall that jumps with
    /// its frames, is sometimes lost, and saturates.
    fn pushed(seed: u32, has_account: bool) -> (f32, f32) {
        let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
        let wall = ForbiddenRegion::new(spring, 5.0).unwrap();
        let mut account = EnergyAccount::new(1.0, 0.5, 1.0).unwrap();
        let mut seed = seed.wrapping_mul(2_654_435_761) | 1;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        let (mut at, mut velocity, mut surface, mut push) = (8.0_f32, 0.0_f32, 0.0, 4.5);
        let (mut given, mut most, mut step, mut before) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0);
        let mut lost = 0;
        for tick in 0..10_000 {
            if tick % 33 == 0 {
                surface = 4.0 * next() - 2.0;
                push = 9.0 * next();
                lost = if next() < 0.2 { 40 } else { 0 };
            }
            lost -= 1;
            let apart = at - surface;
            let pair = Proximity {
                separation: apart,
                lower: apart,
                accuracy: 0.0,
                side: if apart > 0.0 { Side::Outside } else { Side::Inside },
                axis_distance: apart.abs(),
                direction: Vec3::X,
                point_on_surface: Vec3::ZERO,
                point_on_tool: Vec3::ZERO,
                ..Proximity::NOWHERE
            };
            let answer = if lost > 0 { Err(Unavailable::NoSurface) } else { Ok(pair) };
            let wanted = wall.force(&answer, Vec3::X * velocity);
            let is_held = matches!(wanted.state, ConstraintState::Safe(_));
            assert_eq!(is_held, lost > 0);
            let force = if has_account {
                account.pass(wanted.force, Vec3::X * velocity, TICK).x
            } else {
                wanted.force.x
            };
            if (force - before).abs() > step {
                step = (force - before).abs();
            }
            before = force;
            velocity += (force - push - velocity * 0.02) * (TICK / 2e-4);
            at += velocity * TICK;
            given += force * velocity * TICK;
            if given > most {
                most = given;
            }
        }
        (most, step)
    }

    #[test]
    fn no_wall_gives_more_than_its_tank() {
        let mut exceeded = 0;
        for seed in 0..200 {
            let (given, step) = pushed(seed, true);
            assert!(given <= 1.0 && step <= 0.5, "{seed}: {given} mJ, {step} N");
            let (given, step) = pushed(seed, false);
            exceeded += usize::from(given > 2.0 && step > 2.0);
        }
        assert!(exceeded > 50, "{exceeded}");
    }

    #[test]
    fn a_force_against_a_push_is_whole() {
        let mut account = EnergyAccount::new(1.0, 0.5, 1.0).unwrap();
        for tick in 0..100 {
            let wanted = Vec3::X * (0.04 * tick as f32);
            let force = account.pass(wanted, Vec3::X * -40.0, TICK);
            assert_eq!(force, wanted);
        }
        // Energy that was not given is not returned.
        assert!(account.balance() <= 1.0 + 4.0 * 4.0 / 2.0 + 1e-3);
        for bad in [f32::NAN, f32::INFINITY] {
            let force = account.pass(Vec3::Y * bad, Vec3::ZERO, TICK);
            assert!(force.is_finite());
            let force = account.pass(Vec3::Y, Vec3::Y * bad, TICK);
            assert!(force.is_finite() && account.balance().is_finite());
            assert!(EnergyAccount::new(bad, 0.5, 1.0).is_err());
        }
        assert_eq!(EnergyAccount::new(1.0, 0.0, 1.0).unwrap_err().parameter, "step");
        assert_eq!(EnergyAccount::new(1.0, 0.5, -1.0).unwrap_err().parameter, "stiffness");
    }

    /// A sum of infinite parts is not a number: then the account is empty, and there is no force.
    #[test]
    fn what_overflows_empties_the_account() {
        let mut account = EnergyAccount::new(1.0, 1e20, 1.0).unwrap();
        let wanted = Vec3::new(1e19, 1e19, 0.0);
        assert_eq!(account.pass(wanted, Vec3::ZERO, 1.0), wanted);
        // The work is infinite along one axis, and its opposite along the other.
        let force = account.pass(Vec3::ZERO, Vec3::new(1e20, -1e20, 0.0), 1.0);
        assert_eq!((account.balance(), force), (0.0, Vec3::ZERO));
        // The force would give infinite work at once.
        let mut account = EnergyAccount::new(1.0, 1e20, 1.0).unwrap();
        assert_eq!(account.pass(Vec3::X * 1e19, Vec3::X * 1e20, 1.0), Vec3::ZERO);
    }
}

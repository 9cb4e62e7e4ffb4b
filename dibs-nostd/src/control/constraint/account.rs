//! An account of the energy that a wall gives, and a limit on the force's steps.

// Requirement: C-04

#[cfg(test)]
mod tests;

use glam::Vec3;

use super::{GainError, SpringDamper, positive};
use crate::math::sqrt::sqrt;

/// Keeps an account of the energy that a wall's force gives to the hand, relative to the wall, and reduces the force
/// where the energy given would exceed the energy received by more than a stated tank.
///
/// A spring in continuous time returns the energy that it received. Sampling, a frame that moves the wall in one tick,
/// the end of a hold and a saturation that yields give more. The account sums force times relative velocity (a
/// passivity observer: Hannaford & Ryu, IEEE T-RA 2002) and removes from the force the part along an outward motion
/// that the account does not cover. The energy received from the hand counts up to the elastic energy of the spring, so
/// that a damper does not fill the account.
///
/// Between two ticks the force changes by at most a largest step, also where the account requires more: if the relative
/// velocity leaps outwards at a large force, the wall gives more than the tank until the force has fallen. All these
/// overdrafts together are at most what the largest force gives while it falls once, at the largest speed: the force is
/// limited to one whose fall the remainder covers. So no wall gives more than [`most`](Self::most), however often it
/// moves, at speeds up to the stated one; of a faster motion only this speed is counted. A force against an inward
/// motion is not reduced before the tank is overdrawn.
///
/// An overdraft that is used up recovers by a tenth of the tank per second up to an eighth of the tank, which a wall may
/// give in addition; from there the work of inward motions makes the wall stiff again.
///
/// ```
/// use dibs_nostd::constraint::{EnergyAccount, SpringDamper};
/// use dibs_nostd::glam::Vec3;
///
/// let spring = SpringDamper::stiffness(1.0).max_force(5.0);
/// let mut account = EnergyAccount::new(1.0, 0.5, &spring, 300.0)?; // mJ, N a tick, N/mm, mm/s
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
    /// Sum (N) of the largest force and of those that follow it, each a step less, until zero.
    fall: f32,
    /// mm/s.
    speed: f32,
    /// mJ that may still be given.
    balance: f32,
    /// The last force (N).
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    force: Vec3,
}

/// The fraction of the balance that a tick may give: as the balance runs out, the force falls by this fraction of
/// itself per tick.
const PART: f32 = 1.0 / 16.0;

/// The fraction of the tank up to which an empty account recovers by itself, and the fraction per second.
const SEED: f32 = 1.0 / 8.0;
const RECOVERY: f32 = 1.0 / 10.0;

/// A factor that covers the rounding of a step.
const ROUNDING: f32 = 1.0 - 4.0 * f32::EPSILON;

impl EnergyAccount {
    /// An account with a full tank (mJ), for forces that change by at most `step` (N) per tick, of a wall with this
    /// spring, and a tool whose speed relative to the wall is at most `speed` (mm/s).
    ///
    /// # Errors
    /// [`GainError`] names the number that is not above 0 and finite, or the spring's that is out of range.
    pub const fn new(
        tank: f32,
        step: f32,
        spring: &SpringDamper,
        speed: f32,
    ) -> Result<Self, GainError> {
        let tank = tri!(positive("tank", tank));
        let step = tri!(positive("step", step));
        let SpringDamper { stiffness, max_force, .. } = tri!(spring.checked());
        let speed = tri!(positive("speed", speed));
        let steps = (max_force / step) as u32 as f32;
        let fall = (steps + 1.0) * (max_force - 0.5 * step * steps);
        Ok(Self { tank, step, stiffness, fall, speed, balance: tank, force: Vec3::ZERO })
    }

    /// A bound (mJ) on what a wall gives in ticks of this period (s), at speeds up to the stated one: on the energy given,
    /// less the energy received, and less the energy by which the account recovered over time. It is the tank, plus what
    /// the largest force `F` gives while it falls to zero, which is at most `speed period (F + step / 2)^2 / (2 step)`.
    #[must_use]
    pub const fn most(&self, period: f32) -> f32 {
        self.tank + self.fall * (self.speed * period)
    }

    /// The energy (mJ) that may still be given; below 0 after an overdraft.
    #[must_use]
    pub const fn balance(&self) -> f32 {
        self.balance
    }

    /// The force to apply for the next period (s), for the `force` computed by a constraint.
    ///
    /// `velocity` (mm/s) is the tool's relative to the wall since the last tick, as for the constraint. If an input or
    /// its square is not finite, the force falls to zero in steps. A motion that is not known counts as one along the
    /// force at the largest speed, a period that is not above 0 and finite as none.
    ///
    /// Cost: some 100 f32 operations and seven roots.
    #[must_use]
    pub fn pass(&mut self, force: Vec3, velocity: Vec3, period: f32) -> Vec3 {
        let is_timed = period > 0.0 && period.is_finite();
        let period = if is_timed { period } else { 0.0 };
        let (farthest, moved) = (self.speed * period, velocity * period);
        let is_known = length(moved).is_finite();
        // The last force's work.
        let work = if is_known {
            self.force.dot(limited(moved, farthest))
        } else {
            length(self.force) * farthest
        };
        let balance = self.balance - work;
        let is_asked = is_timed && is_known && length(force).is_finite();
        let (wanted, moved) = if is_asked { (force, moved) } else { (Vec3::ZERO, Vec3::ZERO) };
        let lowest = -self.fall * farthest;
        let recovered = balance + self.tank * RECOVERY * period;
        let balance = balance.max(recovered.min(lowest + self.tank * SEED));
        let most = self.tank + wanted.length_squared() / (2.0 * self.stiffness);
        self.balance = balance.min(most);
        let mut wanted = wanted;
        let (given, square) = (wanted.dot(moved), moved.length_squared());
        let tick = self.balance.max(0.0) * PART;
        // A square that is less has lost its precision.
        if given > tick && square >= f32::MIN_POSITIVE {
            wanted -= moved * ((given - tick) / square);
        }
        // Towards zero as far as required, then towards the wanted force. Both are covered, so each force on the line
        // between them is.
        let covered = self.covered((self.balance - lowest) / farthest);
        let size = length(self.force);
        let step = (self.step - size * f32::EPSILON) * ROUNDING;
        let falls = (size - covered).max(0.0).min(step);
        let fallen = if falls > 0.0 { self.force * ((size - falls) / size) } else { self.force };
        let next = fallen + limited(limited(wanted, covered) - fallen, step - falls);
        self.force = if next.is_finite() { next } else { Vec3::ZERO };
        self.force
    }

    /// The largest force (N) that sums up to `fall` (N) while it falls to zero, a step per tick.
    fn covered(&self, fall: f32) -> f32 {
        let fall = fall / self.step;
        if !(fall > 0.0) {
            return 0.0;
        }
        // After `steps` steps and a part of one, `steps + 1` forces were given.
        let steps = ((sqrt(1.0 + 8.0 * fall) - 1.0) * 0.5) as u32 as f32;
        let force = self.step * (fall / (steps + 1.0) + 0.5 * steps);
        if force.is_finite() { force } else { f32::MAX }
    }
}

fn length(vector: Vec3) -> f32 {
    sqrt(vector.length_squared())
}

/// The vector with a length of at most `most`.
fn limited(vector: Vec3, most: f32) -> Vec3 {
    let size = length(vector);
    if size > most { vector * (most / size * ROUNDING) } else { vector }
}

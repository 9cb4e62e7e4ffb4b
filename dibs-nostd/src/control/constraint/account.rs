//! An account of the energy that a wall gives, and a limit on the force's steps.

// Requirement: C-04

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
    use crate::query::{Proximity, Side};
    use crate::unavailable::Unavailable;

    const TICK: f32 = 0.001;

    const SPRING: SpringDamper = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);

    /// What 5, 4.5 ... 0.5 N give at 300 mm/s (mJ).
    const OVERDRAFT: f32 = 27.5 * 0.3;

    fn account() -> EnergyAccount {
        EnergyAccount::new(1.0, 0.5, &SPRING, 300.0).unwrap()
    }

    /// The most energy given to a hand of 200 g, and the largest step of the force, in 10 s at a wall that jumps with
    /// its frames, is sometimes lost, and saturates.
    fn pushed(seed: u32, has_account: bool) -> (f32, f32) {
        let wall = ForbiddenRegion::new(SPRING, 5.0).unwrap();
        let mut account = account();
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

    /// The most energy given in 10 s, less that by which the account recovered over time, by a wall that asks for a force of
    /// up to 5 N in any direction, at motions of up to the stated speed that know the force: into the wall slowly or fast,
    /// and along its force as fast as they can. Some are not measured.
    fn taken(seed: u32) -> f32 {
        let mut account = account();
        let mut seed = seed.wrapping_mul(2_654_435_761) | 1;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        let (mut wanted, mut speed, mut is_random) = (Vec3::ZERO, 0.0, false);
        let (mut given, mut most, mut force) = (0.0_f64, 0.0_f64, Vec3::ZERO);
        let mut left = 0;
        for tick in 0..10_000 {
            if left == 0 {
                left = 1 + (next() * next() * 60.0) as u32;
                let along = Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
                wanted = if next() < 0.5 { Vec3::X } else { along.normalize_or(Vec3::X) };
                wanted *= 5.0 * next().max(next());
                speed = match (next() * 4.0) as u32 {
                    0 => 300.0,
                    1 => -300.0 * next(),
                    2 => -20.0 * next(),
                    _ => 600.0 * next() - 300.0,
                };
                is_random = next() < 0.1;
            }
            left -= 1;
            let along = if is_random { wanted } else { force };
            let velocity = along.normalize_or(wanted.normalize_or(Vec3::X)) * speed;
            given += f64::from(force.dot(velocity * TICK));
            let recovered = 0.1 * f64::from(tick as f32 * TICK);
            most = most.max(given - recovered);
            let before = force;
            let seen = if next() < 0.02 { Vec3::NAN } else { velocity };
            force = account.pass(wanted, seen, TICK);
            assert!(force.distance(before) <= 0.5, "{seed}: a step from {before} to {force}");
        }
        most as f32
    }

    #[test]
    fn no_wall_gives_more_than_its_tank_and_one_fall_however_it_moves() {
        let limit = account().most(TICK);
        let mut largest = 0.0_f32;
        for seed in 0..2_000 {
            let taken = taken(seed);
            assert!(taken <= limit * 1.0001, "{seed}: {taken} mJ");
            largest = largest.max(taken);
        }
        // The search comes close.
        assert!(largest > 0.95 * limit, "{largest} mJ");
    }

    #[test]
    fn a_force_against_a_push_is_whole() {
        let mut account = account();
        for tick in 0..100 {
            let wanted = Vec3::X * (0.04 * tick as f32);
            let force = account.pass(wanted, Vec3::X * -40.0, TICK);
            assert_eq!(force, wanted);
        }
        assert_eq!(account.most(TICK), 1.0 + OVERDRAFT);
        // Energy that was not given is not returned.
        assert!(account.balance() <= 1.0 + 4.0 * 4.0 / 2.0 + 1e-3);
        for bad in [f32::NAN, f32::INFINITY] {
            let force = account.pass(Vec3::Y * bad, Vec3::ZERO, TICK);
            assert!(force.is_finite());
            let force = account.pass(Vec3::Y, Vec3::Y * bad, TICK);
            assert!(force.is_finite() && account.balance().is_finite());
            assert!(EnergyAccount::new(bad, 0.5, &SPRING, 300.0).is_err());
        }
        let parameter = |step, stiffness, speed| {
            let spring = SpringDamper::stiffness(stiffness).max_force(5.0);
            EnergyAccount::new(1.0, step, &spring, speed).unwrap_err().parameter
        };
        assert_eq!(parameter(0.0, 1.0, 300.0), "step");
        assert_eq!(parameter(0.5, -1.0, 300.0), "stiffness");
        assert_eq!(parameter(0.5, 1.0, f32::NAN), "speed");
    }

    /// An input that is not finite, or whose square is not, ends the force in steps.
    #[test]
    fn what_is_not_known_ends_the_force() {
        let full = account();
        // 1 N and 0.5 N at 300 mm/s.
        let unknown = 1.0 - 1.5 * 0.3;
        for (force, velocity, period, balance) in [
            (1e20, 0.0, TICK, 1.0),
            (1.0, 1e30, TICK, unknown),
            (1.0, f32::NAN, TICK, unknown),
            (1.0, 0.0, f32::NAN, 1.0),
            (1.0, 0.0, f32::INFINITY, 1.0),
            (1.0, 300.0, 0.0, 1.0),
        ] {
            let mut account = full;
            for _ in 0..3 {
                let _ = account.pass(Vec3::X, Vec3::ZERO, TICK);
            }
            let mut before = Vec3::X;
            for _ in 0..3 {
                let force = account.pass(Vec3::X * force, Vec3::X * velocity, period);
                assert!(before.distance(force) <= 0.5 && force.x >= 0.0, "{before} {force}");
                before = force;
            }
            assert_eq!(before, Vec3::ZERO);
            assert!((account.balance() - balance).abs() < 1e-4, "{velocity} {period}: {account:?}");
        }
    }

    /// However little an outward motion is, an empty account removes the force in steps.
    #[test]
    fn a_slow_motion_makes_no_step() {
        for exponent in 0..45 {
            let mut account = account();
            let mut before = Vec3::X * 5.0;
            (account.balance, account.force) = (0.0, before);
            for _ in 0..10 {
                let speed = 10.0_f32.powi(-exponent);
                let force = account.pass(Vec3::X * 5.0, Vec3::X * speed, TICK);
                assert!(before.distance(force) <= 0.5, "{speed} mm/s: {before} {force}");
                before = force;
            }
        }
    }

    /// Motions along the force use up the tank and the overdraft. Where nothing is received, a tenth of the tank comes
    /// back in a second, up to an eighth; and the work of inward motions makes the wall stiff again.
    #[test]
    fn a_wall_that_used_up_its_tank_becomes_stiff_again() {
        let mut account = account();
        // The tank is used up where the wanted force leaps; the overdraft where an inward motion comes between.
        let mut least = 0.0_f32;
        for tick in 0..3_000 {
            let speed = if tick % 20 == 0 { -1.0 } else { 300.0 };
            let _ = account.pass(Vec3::X * 5.0, Vec3::X * speed, TICK);
            least = least.min(account.balance());
        }
        assert!((least + OVERDRAFT).abs() < 0.1, "{least}");
        for _ in 0..2_000 {
            let _ = account.pass(Vec3::X * 5.0, Vec3::ZERO, TICK);
        }
        let eighth = account.balance() + OVERDRAFT;
        assert!((eighth - 0.125).abs() < 0.001, "{eighth}");
        // 5 mm inwards.
        let mut force = Vec3::ZERO;
        for _ in 0..50 {
            force = account.pass(Vec3::X * 5.0, Vec3::X * -100.0, TICK);
        }
        assert!(force.x > 4.5, "{force}");
    }
}

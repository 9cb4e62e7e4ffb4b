//! From the closest pair to the force of a dynamic active constraint.
//!
//! Two constraints, both a spring and a damper along the closest pair's direction: [`ForbiddenRegion`] keeps the tool
//! out of a margin around the surface, [`Guidance`] keeps it at a stand-off. From all contacts of a tool, [`Proxy`]
//! makes a force and a torque that keep it out, and [`VelocityRow`] a constraint for a controller's quadratic program.
//! Units: mm, mm/s, N, N mm, N/mm, N s/mm, s. A force of one pair costs some tens of f32 operations and one root,
//! without a loop.
//!
//! # Promises
//!
//! - For any input a force is finite and never larger than `max_force` (up to the direction's rounding).
//! - It is computed from the lower end of the [certified interval](crate::Proximity::interval).
//! - If the surface has sides (a tree with adjacency, see [`Side`](crate::Side)), the force leads outwards from first
//!   contact to any depth, and its size is continuous through contact and through the surface. If it has none, or the
//!   query was [`unsigned`](crate::Options::unsigned), the tool is taken to be outside, and a query cut short by its
//!   budget never weakens the force.
//! - If the side is undefined, the output is the hold, never [`Inactive`](ConstraintState::Inactive): the tool may be
//!   inside. Only at the surface itself, where both sides have nearly the same separation, the constraint acts on it.
//!   After a first certain tick a [`Tracker`](crate::Tracker) always has a side, for any budget, as long as the
//!   surface's motion is measured and not larger than stated.
//! - If the proximity is unknown, the surface stale, or a number not finite, the output is the *hold*: pure damping
//!   against the tool's velocity with the same saturation, and the state gives the reason. For a velocity that is not
//!   finite it is zero.
//!
//! # Passivity
//!
//! A sampled virtual wall generates energy; an [`EnergyAccount`] bounds that energy, and the force's steps. Without an
//! account nothing is promised. Colgate and Schenkel ("Passivity of a class of sampled-data systems", J. Robotic
//! Systems 14, 1997; ACC 1994) show that with sampling period `T`, stiffness `K` and damping `B` it is passive exactly
//! if the device's own physical damping `b` satisfies `b > K T / 2 + |B|`, for velocities by backward difference; a
//! velocity filter and delays need more. [`SpringDamper::device_damping`] computes that value. Other effects:
//!
//! - On entering a margin the damper acts at once: the force jumps by `B` times the approach speed.
//! - Where two parts of the surface are equally near (the medial axis), the closest point jumps from one tick to the
//!   next, and with it the force's direction, but not its size. The same happens in a narrow gap whose margins overlap:
//!   choose the margin below half the gap. A tracker does not oscillate with the last digits of a pose.
//! - A moving surface moves the wall: it does work on the tool, as a beating heart would.
//! - Saturation: a hand that pushes harder than `max_force` gets through.

// Requirement: C-02

mod account;
mod forbidden;
mod guidance;
mod proxy;
mod rows;
#[cfg(test)]
mod tests;
mod walls;

use core::fmt;

use glam::Vec3;

use crate::math::order::{larger, smaller};
use crate::math::round::sum_down;
use crate::math::sqrt::sqrt;
use crate::query::{NoSide, Proximity, Side};
use crate::unavailable::Unavailable;

pub use account::EnergyAccount;
pub use forbidden::ForbiddenRegion;
pub use guidance::Guidance;
pub use proxy::{Proxy, Wrench};
pub use rows::VelocityRow;

/// A force on the tool, and the constraint's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstraintForce {
    /// The force on the tool, at its point of the closest pair, in N. Always finite.
    pub force: Vec3,
    /// The constraint's state.
    pub state: ConstraintState,
}

impl ConstraintForce {
    /// No force.
    pub const NONE: Self = Self { force: Vec3::ZERO, state: ConstraintState::Inactive };
}

#[cfg(feature = "defmt")]
impl defmt::Format for ConstraintForce {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{} N, {}", self.force.to_array(), self.state);
    }
}

/// The state of a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum ConstraintState {
    /// The constraint does not act: there is no force.
    Inactive,
    /// The constraint acts.
    Active,
    /// The constraint acts with its largest force.
    Saturated,
    /// The proximity cannot be used: the force is the hold.
    Safe(Unavailable),
}

/// A spring and damper with a largest force, used by every constraint. The constraint's constructor checks it.
///
/// ```
/// use dibs_nostd::constraint::SpringDamper;
///
/// const SPRING: SpringDamper = SpringDamper::stiffness(2.0).damping(0.01).max_force(5.0); // N/mm, N s/mm, N
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpringDamper {
    stiffness: f32,
    damping: f32,
    /// `None`: the same as `damping`.
    hold_damping: Option<f32>,
    max_force: f32,
}

impl SpringDamper {
    /// A spring of a stiffness in N/mm, above 0, without damping. Its [largest force](Self::max_force) must be set too.
    #[must_use]
    pub const fn stiffness(stiffness: f32) -> Self {
        Self { stiffness, damping: 0.0, hold_damping: None, max_force: f32::INFINITY }
    }

    /// The same with a damping in N s/mm, at least 0. The hold uses it too, unless [`hold_damping`](Self::hold_damping)
    /// is set.
    #[must_use]
    pub const fn damping(self, damping: f32) -> Self {
        Self { damping, ..self }
    }

    /// The same with another damping (N s/mm, at least 0) for the hold; with 0 the hold applies no force.
    #[must_use]
    pub const fn hold_damping(self, damping: f32) -> Self {
        Self { hold_damping: Some(damping), ..self }
    }

    /// The same with the largest force in N, above 0 and finite.
    #[must_use]
    pub const fn max_force(self, max_force: f32) -> Self {
        Self { max_force, ..self }
    }

    /// Returns `self` if every parameter is finite and in range; otherwise [`GainError`] with one that is not.
    const fn checked(self) -> Result<Self, GainError> {
        tri!(positive("stiffness", self.stiffness));
        tri!(not_negative("damping", self.damping));
        tri!(not_negative("hold_damping", self.held()));
        tri!(positive("max_force", self.max_force));
        Ok(self)
    }

    const fn held(&self) -> f32 {
        match self.hold_damping {
            Some(damping) => damping,
            None => self.damping,
        }
    }

    /// The device's own damping (N s/mm) must exceed this for a passive wall at a sampling period of `tick` seconds:
    /// `K T / 2 + B` (Colgate and Schenkel 1997), or the hold's damping if larger.
    ///
    /// ```
    /// use dibs_nostd::constraint::SpringDamper;
    /// let wall = SpringDamper::stiffness(2.0).damping(0.001).max_force(5.0);
    /// assert_eq!(wall.device_damping(0.001), 0.002); // 2 N s/m at 1 kHz
    /// ```
    #[must_use]
    pub fn device_damping(&self, tick: f32) -> f32 {
        let wall = self.stiffness * tick / 2.0 + self.damping;
        larger(self.held(), wall)
    }

    /// Force along the approach's direction of a spring displaced by `length` mm; at least `least` N, which is 0 for a
    /// force that never pulls.
    fn along(&self, approach: &Approach, length: f32, least: f32) -> ConstraintForce {
        let force = self.stiffness * length - self.damping * approach.speed;
        let (force, state) = if force >= self.max_force {
            (self.max_force, ConstraintState::Saturated)
        } else if force > least {
            (force, ConstraintState::Active)
        } else if force.is_nan() {
            // Two infinities that cancel.
            return self.hold(approach.velocity, Unavailable::NotFinite);
        } else if least < 0.0 {
            (least, ConstraintState::Saturated)
        } else {
            (0.0, ConstraintState::Active)
        };
        ConstraintForce { force: approach.direction * force, state }
    }

    /// The safe output: damping against the velocity, saturated.
    fn hold(&self, velocity: Vec3, reason: Unavailable) -> ConstraintForce {
        // Scaled by the largest axis, so that no square overflows or vanishes.
        let mut largest = 0.0;
        for axis in velocity.to_array() {
            let axis = axis.abs();
            if axis > largest {
                largest = axis;
            }
        }
        let scaled = velocity / largest;
        let length = sqrt(scaled.length_squared());
        let wanted = self.held() * (largest * length);
        let size = smaller(wanted, self.max_force);
        let force = scaled / length * -size;
        // NaN from a velocity of zero, or from one that is not finite.
        let force = if force.is_finite() { force } else { Vec3::ZERO };
        ConstraintForce { force, state: ConstraintState::Safe(reason) }
    }
}

/// The data of a closest pair that a constraint uses.
#[derive(Clone, Copy)]
struct Approach {
    /// Unit vector that leads out.
    direction: Vec3,
    /// Conservative separation, in mm; negative for the depth of a penetration.
    separation: f32,
    /// Speed along the direction, in mm/s: positive when the tool moves away.
    speed: f32,
    velocity: Vec3,
}

impl Approach {
    fn new(
        proximity: &Result<Proximity, Unavailable>,
        velocity: Vec3,
    ) -> Result<Self, Unavailable> {
        let proximity = proximity.as_ref().map_err(|unavailable| *unavailable)?;
        let direction = proximity.direction;
        let separation = match proximity.side {
            Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency) => proximity.interval().lower,
            Side::Undefined(_) if proximity.is_at_surface() => {
                let inside = sum_down(proximity.lower, -2.0 * proximity.axis_distance);
                sum_down(inside, -proximity.accuracy)
            }
            // If the tool is inside, the direction leads inwards.
            Side::Undefined(NoSide::CutShort) => return Err(Unavailable::CutShort),
            Side::Undefined(_) => return Err(Unavailable::NoSide),
            _ => proximity.interval().lower,
        };
        if direction == Vec3::ZERO {
            return Err(Unavailable::NoDirection);
        }
        let approach = Self { direction, separation, speed: velocity.dot(direction), velocity };
        let is_unit = (direction.length_squared() - 1.0).abs() < 1.0e-3;
        let is_finite = proximity.separation.is_finite()
            && proximity.point_on_surface.is_finite()
            && proximity.point_on_tool.is_finite()
            && approach.separation.is_finite()
            && approach.speed.is_finite();
        if is_unit && is_finite { Ok(approach) } else { Err(Unavailable::NotFinite) }
    }
}

/// A constraint's gain is out of range.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct GainError {
    /// The parameter's name.
    pub parameter: &'static str,
    /// Its value.
    pub value: f32,
}

impl fmt::Display for GainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot be {}", self.parameter, self.value)
    }
}

impl core::error::Error for GainError {}

const fn positive(parameter: &'static str, value: f32) -> Result<f32, GainError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(GainError { parameter, value }) }
}

const fn not_negative(parameter: &'static str, value: f32) -> Result<f32, GainError> {
    if value >= 0.0 && value.is_finite() { Ok(value) } else { Err(GainError { parameter, value }) }
}

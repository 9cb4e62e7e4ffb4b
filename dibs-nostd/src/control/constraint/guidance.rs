//! Keeps the tool near the surface: a spring to a stand-off.

use glam::Vec3;

use super::{Approach, ConstraintForce, GainError, SpringDamper, not_negative};
use crate::query::Proximity;
use crate::unavailable::Unavailable;

/// Draws the tool to a stand-off from the surface, with a dead band in which it is free.
///
/// Force along the closest pair's direction, with `d`, the lower end of its
/// [interval](Proximity::interval), and `e = d - stand_off`:
///
/// `F = -K (e -/+ dead_band) - B v` for `e` above / below the dead band, else 0, saturated at
/// `max_force` both ways.
///
/// The lower end of the interval is conservative here too: it gives the least pull towards the surface, and the largest
/// push away from it.
///
/// ```
/// use dibs_nostd::constraint::{ConstraintState, Guidance, SpringDamper};
/// use dibs_nostd::{Millis, Unavailable, glam::Vec3};
///
/// let spring = SpringDamper::stiffness(0.5).damping(0.002).max_force(2.0);
/// let guide = Guidance::new(spring, 10.0)?.dead_band(1.0)?; // 9 to 11 mm from the surface is free
/// let safe = guide.force(&Err(Unavailable::Stale { age: Millis(250) }), Vec3::ZERO);
/// assert_eq!(safe.state, ConstraintState::Safe(Unavailable::Stale { age: Millis(250) }));
/// # Ok::<(), dibs_nostd::constraint::GainError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Guidance {
    spring: SpringDamper,
    stand_off: f32,
    dead_band: f32,
}

impl Guidance {
    /// A guide to `stand_off` mm from the surface, at least 0.
    ///
    /// # Errors
    /// [`GainError`] names the parameter of the spring that is out of range, or the stand-off.
    pub const fn new(spring: SpringDamper, stand_off: f32) -> Result<Self, GainError> {
        let spring = tri!(spring.checked());
        let stand_off = tri!(not_negative("stand_off", stand_off));
        Ok(Self { spring, stand_off, dead_band: 0.0 })
    }

    /// The same with a dead band: no force within `dead_band` mm of the stand-off, at least 0.
    ///
    /// # Errors
    /// [`GainError`] if it is negative or not finite.
    pub const fn dead_band(self, dead_band: f32) -> Result<Self, GainError> {
        let dead_band = tri!(not_negative("dead_band", dead_band));
        Ok(Self { dead_band, ..self })
    }

    /// The force on the tool at this tick; `velocity` as in
    /// [`ForbiddenRegion::force`](super::ForbiddenRegion::force).
    #[must_use]
    pub fn force(
        &self,
        proximity: &Result<Proximity, Unavailable>,
        velocity: Vec3,
    ) -> ConstraintForce {
        let approach = match Approach::new(proximity, velocity) {
            Ok(approach) => approach,
            Err(reason) => return self.spring.hold(velocity, reason),
        };
        let error = approach.separation - self.stand_off;
        let length = if error > self.dead_band {
            self.dead_band - error
        } else if error < -self.dead_band {
            -self.dead_band - error
        } else {
            return ConstraintForce::NONE;
        };
        let least = -self.spring.max_force;
        self.spring.along(&approach, length, least)
    }
}

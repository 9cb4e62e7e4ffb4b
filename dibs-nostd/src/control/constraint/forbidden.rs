//! Keeps the tool out of a margin around the surface.

// Requirement: C-02

use glam::Vec3;

use super::{Approach, ConstraintForce, GainError, SpringDamper, positive};
use crate::query::Proximity;
use crate::unavailable::Unavailable;

/// Pushes the tool away from the surface within a margin; never pulls.
///
/// Force along the closest pair's direction, with `d`, the lower end of its [interval](Proximity::interval):
///
/// `F = min(max_force, max(0, K (margin - d) - B v))` for `d < margin`, else 0,
///
/// where `v` is the tool's speed out of the surface, negative on approach. Inside, `d` is negative, and the spring
/// force grows with the depth up to saturation. Without a side the output is the hold. If the query asked for no side
/// ([`Options::unsigned`](crate::Options::unsigned)), the direction is that of the best pair found.
///
/// ```
/// use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
/// use dibs_nostd::{Unavailable, glam::Vec3};
///
/// let spring = SpringDamper::stiffness(2.0).damping(0.01).max_force(5.0); // N/mm, N s/mm, N
/// let wall = ForbiddenRegion::new(spring, 3.0)?; // mm
///
/// // No surface yet: the tool is damped, and the state gives the reason.
/// let safe = wall.force(&Err(Unavailable::NoSurface), Vec3::new(100.0, 0.0, 0.0));
/// assert_eq!(safe.state, ConstraintState::Safe(Unavailable::NoSurface));
/// assert_eq!(safe.force, Vec3::new(-1.0, 0.0, 0.0));
/// # Ok::<(), dibs_nostd::constraint::GainError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ForbiddenRegion {
    spring: SpringDamper,
    margin: f32,
}

impl ForbiddenRegion {
    /// A region that reaches `margin` mm from the surface, above 0.
    ///
    /// # Errors
    /// [`GainError`] names the parameter of the spring that is out of range, or the margin.
    pub const fn new(spring: SpringDamper, margin: f32) -> Result<Self, GainError> {
        let spring = tri!(spring.checked());
        let margin = tri!(positive("margin", margin));
        Ok(Self { spring, margin })
    }

    /// The force on the tool at this tick.
    ///
    /// `velocity` (mm/s) is that of the tool's closest point relative to the surface. The tool's absolute velocity may
    /// be used if the surface does not move.
    #[must_use]
    pub fn force(
        &self,
        proximity: &Result<Proximity, Unavailable>,
        velocity: Vec3,
    ) -> ConstraintForce {
        match Approach::new(proximity, velocity) {
            Err(reason) => self.spring.hold(velocity, reason),
            Ok(approach) if approach.separation < self.margin => {
                let depth = self.margin - approach.separation;
                self.spring.along(&approach, depth, 0.0)
            }
            Ok(_) => ConstraintForce::NONE,
        }
    }
}

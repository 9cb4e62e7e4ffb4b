//! A wall around the surface, and its force.

use dibs_nostd::constraint::{self, ConstraintForce, ConstraintState, SpringDamper};
use pyo3::prelude::*;

use crate::guard::Answer;
use crate::tracker::Tracked;
use crate::{error, invalid};

/// A wall around the surface.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct ForbiddenRegion(constraint::ForbiddenRegion);

#[pymethods]
impl ForbiddenRegion {
    #[new]
    fn new(stiffness: f32, damping: f32, hold: f32, most: f32, margin: f32) -> PyResult<Self> {
        let spring = SpringDamper::stiffness(stiffness).damping(damping);
        let spring = spring.hold_damping(hold).max_force(most);
        constraint::ForbiddenRegion::new(spring, margin).map(Self).map_err(invalid)
    }

    /// Force (N), state, and the cause of a hold.
    fn force(&self, answer: &Answer) -> Force {
        force(answer.answer.force(&self.0))
    }

    /// The same of a tracker's pair, for a velocity (mm/s) of the tool relative to the surface.
    fn force_of(&self, tracked: &Tracked, velocity: [f32; 3]) -> Force {
        force(self.0.force(&Ok(tracked.closest()), velocity.into()))
    }
}

/// Force (N), state, and the cause of a hold.
type Force = ([f32; 3], u8, Option<String>);

fn force(force: ConstraintForce) -> Force {
    let (state, cause) = match force.state {
        ConstraintState::Inactive => (0, None),
        ConstraintState::Active => (1, None),
        ConstraintState::Saturated => (2, None),
        ConstraintState::Safe(cause) => (3, Some(error::sentence(cause))),
        _ => (3, None),
    };
    (force.force.to_array(), state, cause)
}

//! A wall around the surface, its force, and the account of the energy that it gives.

use std::sync::{Mutex, PoisonError};

use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::Unavailable;
use dibs_nostd::constraint::{self, ConstraintForce, ConstraintState, SpringDamper, Wrench};
use pyo3::prelude::*;

use crate::guard::Answer;
use crate::surface::KeptContacts;
use crate::tracker::TrackerAnswer;
use crate::{error, invalid};

/// Stiffness, damping, damping of the hold, and largest force.
type Spring = [f32; 4];

fn spring([stiffness, damping, hold, most]: Spring) -> SpringDamper {
    let spring = SpringDamper::stiffness(stiffness).damping(damping);
    spring.hold_damping(hold).max_force(most)
}

/// A wall around the surface.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct ForbiddenRegion(constraint::ForbiddenRegion);

#[pymethods]
impl ForbiddenRegion {
    #[new]
    fn new(of: Spring, margin: f32) -> PyResult<Self> {
        constraint::ForbiddenRegion::new(spring(of), margin).map(Self).map_err(invalid)
    }

    /// Force (N), state, and the cause of a hold.
    fn force(&self, answer: &Answer) -> Force {
        force(answer.answer.force(&self.0))
    }

    /// The same of a tracker's pair, for a velocity (mm/s) of the tool relative to the surface.
    fn force_of(&self, tracked: &TrackerAnswer, velocity: [f32; 3]) -> Force {
        force(self.0.force(&Ok(tracked.closest()), velocity.into()))
    }
}

/// Force (N), state, and the cause of a hold.
type Force = ([f32; 3], u8, Option<String>);

fn force(force: ConstraintForce) -> Force {
    let (state, cause) = number(force.state);
    (force.force.to_array(), state, cause)
}

/// A state's number, and the cause of a hold.
fn number(state: ConstraintState) -> (u8, Option<String>) {
    match state {
        ConstraintState::Inactive => (0, None),
        ConstraintState::Active => (1, None),
        ConstraintState::Saturated => (2, None),
        ConstraintState::Safe(cause) => (3, Some(error::sentence(cause))),
        _ => (3, None),
    }
}

/// A wall that acts by all contacts.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Proxy {
    proxy: constraint::Proxy,
    margin: f32,
}

/// The tool's point to which a torque refers, its velocity (mm/s), and the tool's angular velocity (1/s).
type Twist = [[f64; 3]; 3];

/// Force (N), torque (N mm), state, and the cause of a hold.
type WrenchParts = ([f32; 3], [f32; 3], u8, Option<String>);

#[pymethods]
impl Proxy {
    #[new]
    fn new(of: Spring, margin: f32) -> PyResult<Self> {
        let proxy = constraint::Proxy::new(spring(of), margin).map_err(invalid)?;
        Ok(Self { proxy, margin })
    }

    /// Of a guard's contacts.
    fn force(&self, answer: &Answer, twist: Twist) -> PyResult<WrenchParts> {
        let reason = answer.answer.closest.err();
        self.wrench(answer.contacts.as_deref(), reason, answer.tree.origin, twist)
    }

    /// Of a tracker's contacts.
    fn force_of(&self, tracked: &TrackerAnswer, twist: Twist) -> PyResult<WrenchParts> {
        self.wrench(tracked.contacts.as_deref(), None, tracked.tree.origin, twist)
    }
}

impl Proxy {
    /// The hold if there is a reason for one.
    fn wrench(
        &self,
        contacts: Option<&KeptContacts>,
        reason: Option<Unavailable>,
        origin: DVec3,
        twist: Twist,
    ) -> PyResult<WrenchParts> {
        let list = contacts.ok_or_else(|| {
            invalid("answer: it has no contacts; ask for them with a margin of at least the wall's")
        })?;
        let [at, velocity, angular] = twist.map(DVec3::from);
        let (at, velocity, angular) =
            ((at - origin).as_vec3(), velocity.as_vec3(), angular.as_vec3());
        let within = reason.map_or_else(|| list.within(self.margin), Err);
        let Wrench { force, torque, state, .. } =
            self.proxy.wrench(within, list.accuracy(), at, velocity, angular);
        let (state, cause) = number(state);
        Ok((force.to_array(), torque.to_array(), state, cause))
    }
}

/// An account of the energy that a wall gives.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct EnergyAccount(Mutex<constraint::EnergyAccount>);

impl EnergyAccount {
    fn with<R>(&self, body: impl FnOnce(&mut constraint::EnergyAccount) -> R) -> R {
        body(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl EnergyAccount {
    #[new]
    fn new(tank: f32, step: f32, stiffness: f32, max_force: f32, speed: f32) -> PyResult<Self> {
        let spring = SpringDamper::stiffness(stiffness).max_force(max_force);
        let account = constraint::EnergyAccount::new(tank, step, &spring, speed);
        let account = account.map_err(invalid)?;
        Ok(Self(Mutex::new(account)))
    }

    /// The force to apply.
    fn limit(&self, force: [f32; 3], velocity: [f32; 3], period: f32) -> [f32; 3] {
        let [force, velocity] = [force, velocity].map(Vec3::from);
        self.with(|account| account.pass(force, velocity, period)).to_array()
    }

    fn balance(&self) -> f32 {
        self.with(|account| account.balance())
    }
}

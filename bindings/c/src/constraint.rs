//! Constraints: the force that keeps a tool out of a margin around the surface.

use bytemuck::AnyBitPattern;
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, Proxy, SpringDamper, Wrench};
use dibs_nostd::{Proximity, Unavailable};

use crate::border::{Handle, Input, Output};
use crate::code::dibs_code;
use crate::contacts::dibs_contacts;
use crate::query::dibs_proximity;
use crate::tool::dibs_vec3;

/// A wall: a margin around the surface, with a spring and a damper.
///
/// A sampled wall is passive only if the device's own damping is above `stiffness * tick / 2 + damping`.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_wall {
    /// In N/mm, above 0.
    pub stiffness: f32,
    /// In N s/mm, at least 0.
    pub damping: f32,
    /// Damping (N s/mm, at least 0) if there is no answer to act on; 0 releases the tool.
    pub hold_damping: f32,
    /// In N, above 0.
    pub max_force: f32,
    /// Distance from the surface at which the wall begins (mm, above 0).
    pub margin: f32,
}

impl dibs_wall {
    fn spring(&self) -> SpringDamper {
        let spring = SpringDamper::stiffness(self.stiffness).damping(self.damping);
        spring.hold_damping(self.hold_damping).max_force(self.max_force)
    }
}

/// Which rule a force comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_force_state {
    /// The tool is outside the margin: no force.
    Inactive = 0,
    /// The wall acts.
    Active = 1,
    /// The wall acts with its largest force.
    Saturated = 2,
    /// The answer cannot be used: the force is the hold, pure damping.
    Safe = 3,
}

/// A force and a torque on the tool.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_force {
    /// In N. Always finite.
    pub force: dibs_vec3,
    /// In N mm, about the given point. Always finite; zero for a single pair.
    pub torque: dibs_vec3,
    /// Which rule they come from.
    pub state: dibs_force_state,
    /// The cause of a hold; otherwise `DIBS_CODE_OK`.
    pub cause: dibs_code,
}

impl dibs_force {
    /// `outcome` is the cause of a hold that C requested.
    fn of(Wrench { force, torque, state }: Wrench, outcome: Option<dibs_code>) -> Self {
        let (state, cause) = match state {
            ConstraintState::Inactive => (dibs_force_state::Inactive, dibs_code::Ok),
            ConstraintState::Active => (dibs_force_state::Active, dibs_code::Ok),
            ConstraintState::Saturated => (dibs_force_state::Saturated, dibs_code::Ok),
            ConstraintState::Safe(cause) => {
                (dibs_force_state::Safe, outcome.unwrap_or(cause.into()))
            }
            _ => (dibs_force_state::Safe, dibs_code::Unavailable),
        };
        Self { force: force.into(), torque: torque.into(), state, cause }
    }
}

/// The code of the preceding calls, if it is an error.
fn failure(outcome: u32) -> Option<dibs_code> {
    match dibs_code::from_number(outcome) {
        Some(dibs_code::Ok) => None,
        Some(code) => Some(code),
        None => Some(dibs_code::Argument),
    }
}

/// The force of a wall on the tool, from its closest pair.
///
/// Call it at every tick, with the code of the call that returned the pair: with an error the force is the hold, pure
/// damping.
///
/// @param wall       The wall.
/// @param outcome    The code of the query, of the fail-safe machine, or of the reader: the first one that was not
///                   `DIBS_CODE_OK`.
/// @param proximity  The closest pair; not read, and may be null, if the outcome is an error.
/// @param velocity   Velocity (mm/s) of the tool's closest point relative to the surface.
/// @param force      Receives the force.
/// @return `DIBS_CODE_OK`, even if the force is the hold; `DIBS_CODE_GAIN`; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_wall_force(
    wall: *const dibs_wall,
    outcome: u32,
    proximity: *const dibs_proximity,
    velocity: dibs_vec3,
    force: *mut dibs_force,
) -> dibs_code {
    dibs_code::of(|| {
        let (force, wall, failure) = (force.check()?, wall.get()?, failure(outcome));
        let region = ForbiddenRegion::new(wall.spring(), wall.margin)?;
        let proximity = match failure {
            None => Ok(Proximity::try_from(proximity.get()?)?),
            Some(_) => Err(Unavailable::NoSurface),
        };
        let found = region.force(&proximity, velocity.into());
        let wrench = Wrench { force: found.force, state: found.state, ..Wrench::NONE };
        force.set(dibs_force::of(wrench, failure));
        Ok(())
    })
}

/// The force and the torque of a wall on the tool, from all its contacts: by a proxy that the contacts together keep
/// outside.
///
/// @param wall      The wall. Its margin is at most that of the contacts.
/// @param outcome   As for `dibs_wall_force`.
/// @param contacts  The list.
/// @param origin    The tool's point (mm) that torque and velocity refer to.
/// @param velocity  Velocity (mm/s) of the tool at `origin`.
/// @param angular   Angular velocity (1/s) of the tool.
/// @param force     Receives force and torque.
/// @return `DIBS_CODE_OK`, even if the force is the hold; `DIBS_CODE_GAIN`; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_wall_proxy_force(
    wall: *const dibs_wall,
    outcome: u32,
    contacts: *mut dibs_contacts,
    origin: dibs_vec3,
    velocity: dibs_vec3,
    angular: dibs_vec3,
    force: *mut dibs_force,
) -> dibs_code {
    dibs_code::of(|| {
        let (force, wall, list) = (force.check()?, wall.get()?, contacts.open()?);
        let (proxy, failure) = (Proxy::new(wall.spring(), wall.margin)?, failure(outcome));
        let found = match failure {
            None => list.0.within(wall.margin),
            Some(_) => Err(Unavailable::NoSurface),
        };
        let accuracy = list.0.accuracy();
        let wrench = proxy.wrench(found, accuracy, origin.into(), velocity.into(), angular.into());
        force.set(dibs_force::of(wrench, failure));
        Ok(())
    })
}

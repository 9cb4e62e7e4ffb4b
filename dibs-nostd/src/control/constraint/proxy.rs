//! Keeps the tool out by all its contacts: force and torque from a proxy that stays outside.

// Requirement: C-03

use glam::Vec3;

use super::walls::{MOST, Wall, displacement};
use super::{ConstraintState, GainError, SpringDamper, positive};
use crate::math::round::sum_down;
use crate::math::sqrt::sqrt;
use crate::query::Contact;
use crate::unavailable::Unavailable;

/// A force and a torque on the tool, and the constraint's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench {
    /// The force on the tool (N). Always finite.
    pub force: Vec3,
    /// The torque on the tool (N mm) about the given origin. Always finite.
    pub torque: Vec3,
    /// The constraint's state.
    pub state: ConstraintState,
}

impl Wrench {
    /// No force.
    pub const NONE: Self =
        Self { force: Vec3::ZERO, torque: Vec3::ZERO, state: ConstraintState::Inactive };
}

#[cfg(feature = "defmt")]
impl defmt::Format for Wrench {
    fn format(&self, f: defmt::Formatter<'_>) {
        let Self { force, torque, state } = self;
        defmt::write!(f, "{} N, {} N mm, {}", force.to_array(), torque.to_array(), state);
    }
}

/// Keeps the tool out of a margin around the surface, by all its contacts.
///
/// A proxy (god object: Zilles & Salisbury 1995; Ruspini et al. 1997) is the position nearest to the tool at which no
/// contact would be within the margin. A spring pulls the tool there. With one contact this is a
/// [`ForbiddenRegion`](super::ForbiddenRegion); in a corner it holds against both walls; two contacts with one wall
/// count as one, within 6 %. The force of each contact acts at its point of the tool, which gives the torque.
///
/// The displacement `t` has the least `|t|^2` under `n . t >= margin - d` for each of the eight deepest active
/// contacts, each of which yields by a 16th. An active set method finds it exactly except for rounding. If no two
/// contacts face each other, `t` clears each contact of activation 1 by at least its depth.
///
/// `t` is continuous in depths, normals and *activations*. A contact's activation, from 0 to 1, is the fraction of its
/// depth by which it would move the proxy alone. The deepest contact has 1. Another has less if it is less than a 16th
/// as deep, and 0 at the margin's edge; and less where it begins or ends next to a deeper one, at the edge of its wall:
/// 0 within some 7 degrees of that edge, seen from the tool's axis, and 1 from 10 degrees on. So a contact begins and
/// ends without force, and where two tie both have 1. Next to a wall's edge the force changes by up to
/// `45 K depth / distance` of the axis per mm, for a stiffness `K`.
///
/// Steps of the force remain in these cases:
/// - Two walls less than 15 degrees apart, which may be one contact: up to a quarter of the force, a twelfth in size,
///   as measured outside hearts and brains with the axis at least 0.02 mm from the surface.
/// - Two walls that face each other, both within the margin: together they push the proxy sideways along the tilt
///   between them, and a step may change the size by up to the whole force. Measured with a sphere of 1 mm and a margin
///   of 5 mm: from 4.1 to 0.2 N within 3 nm in a gap of 3 mm whose walls are uneven by 0.2 mm; more than 10 % of the
///   size on 17 % of the paths of half a mm there, and on 3 % in a gap of 6 mm. Choose a margin below half of the
///   narrowest gap, less the tool's radius.
/// - An open rim, where a contact's side may end: up to half of the force.
/// - A tool that crosses or is inside: the deepest contact's direction jumps on the medial axis. Nearer than some 16
///   accuracies the direction is not known: there the force turned by up to 75 degrees at the same size.
/// - Memory, list or budget ran out, so that activations are 1, or there is a ninth active contact, which does not act:
///   steps are not bounded.
///
/// The torque also steps where a contact's point slides along a wall. From a list that is not
/// [complete](crate::ContactIter::is_complete) the force is at least that of the closest pair.
///
/// The damper acts against the tool's speed into the surface, relative to the surface's velocity.
///
/// Cost: about 30 f32 operations per step for each contact within the margin; at most 32 steps, usually about one per
/// contact.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proxy {
    spring: SpringDamper,
    margin: f32,
}

/// A wall whose depth is less than the deepest divided by this has a reduced activation.
const SHALLOW: f32 = 16.0;

/// A contact within the margin.
#[derive(Clone, Copy)]
struct ProxyContact {
    wall: Wall,
    lever: Vec3,
    /// Speed of the tool out of the surface (mm/s).
    speed: f32,
    /// Its part of the proxy's displacement (mm).
    push: f32,
}

impl ProxyContact {
    const NONE: Self = Self { wall: Wall::NONE, lever: Vec3::ZERO, speed: 0.0, push: 0.0 };

    /// The moment of the push.
    fn turned(&self) -> Vec3 {
        self.lever.cross(self.wall.normal * self.push)
    }
}

impl Proxy {
    /// A region that reaches `margin` mm from the surface, above 0.
    ///
    /// # Errors
    /// [`GainError`] names the parameter of the spring that is out of range, or the margin.
    pub const fn new(spring: SpringDamper, margin: f32) -> Result<Self, GainError> {
        let spring = tri!(spring.checked());
        let margin = tri!(positive("margin", margin));
        Ok(Self { spring, margin })
    }

    /// The force on the tool at this tick, and its torque about `origin`.
    ///
    /// `contacts` are those of [`Contacts::within`](crate::Contacts::within) this margin or more, deepest first, each
    /// within `accuracy` (mm); `velocity` (mm/s) is the tool's at `origin`, `angular` (1/s) its angular velocity. An
    /// error instead of contacts gives the hold. For one label, query its contacts
    /// ([`Options::contacts_of`](crate::Options::contacts_of)).
    #[must_use]
    pub fn wrench<'c>(
        &self,
        contacts: Result<impl Iterator<Item = &'c Contact>, Unavailable>,
        accuracy: f32,
        origin: Vec3,
        velocity: Vec3,
        angular: Vec3,
    ) -> Wrench {
        let contacts = match contacts {
            Ok(contacts) => contacts,
            Err(reason) => return self.hold(velocity, reason),
        };
        let mut held = [ProxyContact::NONE; MOST];
        let (mut is_in, mut deepest) = (false, 0.0);
        let mut free = held.iter_mut();
        for contact in contacts {
            let depth = self.margin - sum_down(contact.separation, -accuracy);
            // Written so that NaN is kept.
            if depth <= 0.0 {
                continue;
            }
            if !is_in {
                (is_in, deepest) = (true, depth);
            }
            // A contact with activation 0 must not take the slot of one with more.
            if contact.activation <= 0.0 {
                continue;
            }
            let Some(slot) = free.next() else { break };
            let part = SHALLOW * depth / deepest;
            let whole = contact.activation;
            let activation = if part < 1.0 { part * whole } else { whole };
            let lever = contact.point_on_tool - origin;
            let relative = velocity + angular.cross(lever) - contact.velocity;
            let normal = contact.normal;
            let wall = Wall::new(normal, depth, activation);
            *slot = ProxyContact { wall, lever, speed: normal.dot(relative), push: 0.0 };
        }
        if !is_in {
            return Wrench::NONE;
        }
        let moved = displacement(held.map(|held| held.wall));
        for held in &mut held {
            held.push = held.wall.push(moved);
        }
        self.push(&held, moved, velocity)
    }

    fn push(&self, held: &[ProxyContact; MOST], moved: Vec3, velocity: Vec3) -> Wrench {
        let turned = held.iter().fold(Vec3::ZERO, |sum, held| sum + held.turned());
        let (mut pushes, mut leaving) = (0.0, 0.0);
        for held in held {
            pushes += held.push;
            leaving += held.push * held.speed;
        }
        let length = sqrt(moved.length_squared());
        let speed = leaving / pushes;
        let spring = self.spring.stiffness * length;
        let wanted = spring - self.spring.damping * speed;
        let is_finite = wanted.is_finite() && turned.is_finite();
        if !is_finite {
            return if pushes > 0.0 && length <= 0.0 {
                // The walls balance each other.
                Wrench { state: ConstraintState::Active, ..Wrench::NONE }
            } else {
                self.hold(velocity, Unavailable::NotFinite)
            };
        }
        let most = self.spring.max_force;
        let (size, state) = if wanted >= most {
            (most, ConstraintState::Saturated)
        } else if wanted > 0.0 {
            (wanted, ConstraintState::Active)
        } else {
            (0.0, ConstraintState::Active)
        };
        // One scale for both keeps the ratio of force and torque.
        let scale = if length > 0.0 { size / length } else { 0.0 };
        let (force, torque) = (moved * scale, turned * scale);
        if force.is_finite() && torque.is_finite() {
            Wrench { force, torque, state }
        } else {
            self.hold(velocity, Unavailable::NotFinite)
        }
    }

    fn hold(&self, velocity: Vec3, reason: Unavailable) -> Wrench {
        let held = self.spring.hold(velocity, reason);
        Wrench { force: held.force, torque: Vec3::ZERO, state: held.state }
    }
}

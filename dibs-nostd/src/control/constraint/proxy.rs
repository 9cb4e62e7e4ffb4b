//! Keep out by all contacts together: the force and the torque of a proxy that is held outside.

use glam::Vec3;

use super::{ConstraintState, GainError, SpringDamper, positive};
use crate::math::sqrt::sqrt;
use crate::query::Contact;
use crate::unavailable::Unavailable;

/// Most contacts that take part: the deepest.
const MOST: usize = 8;

/// Rounds of the solver.
const ROUNDS: u32 = 32;

/// How much of its depth a contact yields under its own force: so that two contacts with one wall share it.
const COMPLIANCE: f32 = 1.0 / 16.0;

/// A force and a torque on the tool, and how they came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench {
    /// The force on the tool (N). Always finite.
    pub force: Vec3,
    /// The torque on the tool (N mm) about the point that was asked for. Always finite.
    pub torque: Vec3,
    /// How they came about.
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
/// A proxy (god object: Zilles & Salisbury 1995; Ruspini et al. 1997) is where the tool would be if no contact were
/// within the margin: the nearest such place. A spring draws the tool there. Where one contact is within the margin,
/// that is a [`ForbiddenRegion`](super::ForbiddenRegion); in a corner it is what holds both walls, and two contacts
/// with one wall are one wall, up to 6 %. The force of each contact acts at its own point of the tool, which gives the
/// torque.
///
/// What it solves is the least `|t|^2` under `n . t >= margin - d` for each of the eight deepest contacts, each of
/// which yields by a 16th: 32 rounds of coordinate descent on the contacts' forces. Those are continuous in depths
/// and normals, and a contact that appears at the margin's edge begins with nothing.
///
/// The damper acts against the tool's speed into the surface, relative to the surface where it moves.
///
/// Cost: about 30 f32 operations a round for each pair of contacts within the margin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proxy {
    spring: SpringDamper,
    margin: f32,
}

/// A contact within the margin.
#[derive(Clone, Copy)]
struct Held {
    normal: Vec3,
    lever: Vec3,
    /// How far within the margin (mm).
    depth: f32,
    /// Speed of the tool out of the surface (mm/s).
    speed: f32,
    /// How far it moves the proxy (mm).
    push: f32,
}

impl Held {
    const NONE: Self =
        Self { normal: Vec3::ZERO, lever: Vec3::ZERO, depth: 0.0, speed: 0.0, push: 0.0 };
}

impl Proxy {
    /// A region that reaches `margin` mm from the surface, above 0.
    ///
    /// # Errors
    /// [`GainError`] when the margin is not positive or not finite.
    pub const fn new(spring: SpringDamper, margin: f32) -> Result<Self, GainError> {
        let margin = tri!(positive("margin", margin));
        Ok(Self { spring, margin })
    }

    /// The force on the tool at this tick, and its torque about `origin`.
    ///
    /// `contacts` are those of [`Contacts`](crate::Contacts), deepest first, within `accuracy` (mm); `velocity` (mm/s)
    /// is the tool's at `origin`, `angular` (1/s) its angular velocity. Where there is no answer, the hold.
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
        let mut held = [Held::NONE; MOST];
        let mut count = 0;
        for contact in contacts {
            let depth = self.margin - (contact.separation - accuracy);
            if depth <= 0.0 {
                continue;
            }
            let Some(place) = held.get_mut(count) else { break };
            let lever = contact.point_on_tool - origin;
            let relative = velocity + angular.cross(lever) - contact.velocity;
            let normal = contact.normal;
            *place = Held { normal, lever, depth, speed: normal.dot(relative), push: 0.0 };
            count += 1;
        }
        if count == 0 {
            return Wrench::NONE;
        }
        for _ in 0..ROUNDS {
            for row in 0..count {
                let moved = total(&held, |held| held.normal * held.push);
                let Some(held) = held.get_mut(row) else { break };
                // The depth counts as that much deeper as the contact will yield.
                let wanted = held.depth * (1.0 + COMPLIANCE);
                let left = wanted - held.normal.dot(moved) - COMPLIANCE * held.push;
                let push = held.push + left / (1.0 + COMPLIANCE);
                held.push = if push > 0.0 { push } else { 0.0 };
            }
        }
        self.push(&held, velocity)
    }

    fn push(&self, held: &[Held; MOST], velocity: Vec3) -> Wrench {
        let moved = total(held, |held| held.normal * held.push);
        let turned = total(held, |held| held.lever.cross(held.normal * held.push));
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
                // Walls that balance each other.
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
        // Force and torque keep their proportion.
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

fn total(held: &[Held; MOST], of: impl Fn(&Held) -> Vec3) -> Vec3 {
    held.iter().fold(Vec3::ZERO, |sum, held| sum + of(held))
}

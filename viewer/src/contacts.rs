//! The contacts of an instrument, and the force that holds it off them.

use dibs_nostd::constraint::{ConstraintState, Proxy, SpringDamper};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Contact, Contacts, VertexTable};

/// Room for contacts, and for triangles to compare.
pub type Found = Contacts<16, 4_096>;

/// The wall's spring: soft, since a hand on a mouse is not passive.
const SPRING: SpringDamper = SpringDamper::stiffness(0.5).damping(0.001).max_force(5.0);

/// All contacts within the margin, and the force of all together.
#[derive(Clone, Debug)]
pub struct ContactMarks {
    /// Deepest first.
    pub contacts: Vec<Contact>,
    /// Every contact whose separation is below this is in the list.
    pub bound: f32,
    /// The force on the instrument (N), at its start.
    pub force: Vec3,
    /// Whether the force is the largest.
    pub is_saturated: bool,
    /// Whether the answer cannot carry a force, so that the wall only damps.
    pub is_safe: bool,
}

/// The velocity of an instrument.
#[derive(Clone, Copy, Debug, Default)]
pub struct Velocity {
    /// The axis' start.
    pub origin: Vec3,
    /// Of the start, mm/s.
    pub linear: Vec3,
    /// Around the start, 1/s.
    pub angular: Vec3,
}

impl Velocity {
    /// The velocity of the way between two poses.
    pub fn new(from: &[f32], to: &[f32], seconds: f64) -> Self {
        let point = |pose: &[f32], at: usize| {
            let axes = pose.get(at..at + 3).and_then(|axes| <[f32; 3]>::try_from(axes).ok());
            axes.map(Vec3::from_array)
        };
        let Some((before, origin)) = point(from, 0).zip(point(to, 0)) else {
            return Self::default();
        };
        let rate = if seconds > 0.0 { (1.0 / seconds) as f32 } else { 0.0 };
        let mut angular = Vec3::ZERO;
        if let ([_, _, _, _, _, _, _], Some((old, end))) = (to, point(from, 3).zip(point(to, 3))) {
            let (old, axis) = (old - before, end - origin);
            angular =
                axis.cross(axis - old) * (rate / axis.length_squared().max(f32::MIN_POSITIVE));
        }
        Self { origin, linear: (origin - before) * rate, angular }
    }
}

/// The velocities (mm/s) of a surface on its way from one frame to the next.
#[derive(Clone, Copy, Debug)]
pub struct Speeds<'a> {
    /// Positions of the frame before.
    pub before: &'a [Vec3],
    /// Positions of the last frame.
    pub last: &'a [Vec3],
    /// Frames a second; 0 while the surface stands still.
    pub rate: f32,
}

impl VertexTable for Speeds<'_> {
    fn len(&self) -> usize {
        self.before.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        let at = |frame: &[Vec3]| frame.get(vertex as usize).copied();
        Some((at(self.last)? - at(self.before)?) * self.rate)
    }
}

impl ContactMarks {
    /// The contacts found, and their force.
    pub fn new(found: &Found, margin: f32, velocity: Velocity) -> Self {
        let mut touching = Self {
            contacts: found.iter().copied().collect(),
            bound: found.bound(),
            force: Vec3::ZERO,
            is_saturated: false,
            is_safe: false,
        };
        // A margin of 0 is no wall.
        if let Ok(proxy) = Proxy::new(SPRING, margin) {
            let Velocity { origin, linear, angular } = velocity;
            let contacts = found.within(margin);
            let wrench = proxy.wrench(contacts, found.accuracy(), origin, linear, angular);
            touching.force = wrench.force;
            touching.is_saturated = wrench.state == ConstraintState::Saturated;
            touching.is_safe = matches!(wrench.state, ConstraintState::Safe(_));
        }
        touching
    }
}

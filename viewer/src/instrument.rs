//! The instrument: a sphere or a capsule, as the numbers that the page has.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Sphere};

use crate::SessionError;

/// A sphere or a capsule in the tree's coordinates.
#[derive(Clone, Copy, Debug)]
pub enum Instrument {
    /// Four numbers: the centre and the radius.
    Sphere(Sphere),
    /// Seven numbers: both ends of the axis, and the radius.
    Capsule(Capsule),
}

impl Instrument {
    /// An instrument from its numbers.
    ///
    /// # Errors
    /// [`SessionError::Numbers`] unless they are 4 or 7; [`SessionError::Tool`] for a tool that cannot be.
    pub fn new(numbers: &[f32]) -> Result<Self, SessionError> {
        Ok(match *numbers {
            [x, y, z, radius] => Self::Sphere(Sphere::new(Vec3::new(x, y, z), radius)?),
            [a, b, c, x, y, z, radius] => {
                let (start, end) = (Vec3::new(a, b, c), Vec3::new(x, y, z));
                Self::Capsule(Capsule::new(start, end, radius)?)
            }
            _ => return Err(SessionError::Numbers(numbers.len())),
        })
    }

    /// The instrument on its way from one pose to another; at `share` 1 it is the other, to the bit.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn between(from: &[f32], to: &[f32], share: f32) -> Result<Self, SessionError> {
        if from.len() != to.len() || share >= 1.0 {
            return Self::new(to);
        }
        let mut way = [0.0; 7];
        for ((way, from), to) in way.iter_mut().zip(from).zip(to) {
            *way = from + share * (to - from);
        }
        Self::new(way.get(..to.len()).unwrap_or_default())
    }
}

//! The pose of a whole mesh: a rotation and a shift, checked.
//!
//! Quaternions are stored as received, of any length near one: every rotation divides by the squared length. So a check
//! causes no rounding.

// Requirement: F-08

#[cfg(feature = "control")]
mod step;

use core::fmt;

use glam::{Quat, Vec3};

use crate::MAX_COORDINATE;
#[cfg(feature = "control")]
pub(crate) use step::PoseStep;

/// Largest difference of a quaternion's squared length from one.
const MOST_OFF: f32 = 1.0 / 1_048_576.0;

/// The pose of a whole mesh: its point `p` is at `rotation p + shift`.
///
/// ```
/// use dibs_nostd::{PoseError, RigidPose, glam::{Quat, Vec3}};
///
/// let quarter = Quat::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
/// let pose = RigidPose::new(quarter, Vec3::new(0.0, 0.0, 7.0))?;
/// assert!(pose.apply(Vec3::X).abs_diff_eq(Vec3::new(0.0, 1.0, 7.0), 1e-6));
/// assert!(pose.apply_inverse(Vec3::Y).abs_diff_eq(Vec3::new(1.0, 0.0, -7.0), 1e-6));
/// let stretched = Quat::from_xyzw(0.0, 0.0, 0.0, 1.1);
/// assert!(matches!(RigidPose::new(stretched, Vec3::ZERO), Err(PoseError::NoRotation { .. })));
/// # Ok::<(), PoseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RigidPose {
    turn: Turn,
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    shift: Vec3,
}

/// Why numbers are not a rigid pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PoseError {
    /// A number is infinite or not a number.
    NotFinite,
    /// The quaternion is not a rotation: its squared length is not within 2^-20 of 1.
    NoRotation {
        /// Its squared length.
        squared: f32,
    },
    /// The shift is longer than a quarter of [`MAX_COORDINATE`] on an axis.
    TooFar {
        /// The coordinate.
        value: f32,
    },
}

impl fmt::Display for PoseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a number of the pose is not finite"),
            Self::NoRotation { squared } => {
                write!(f, "a quaternion whose squared length is {squared} is no rotation")
            }
            Self::TooFar { value } => write!(f, "the pose's shift by {value} is too far"),
        }
    }
}

impl core::error::Error for PoseError {}

impl RigidPose {
    /// The identity: mesh and world coordinates are the same.
    pub const IDENTITY: Self = Self { turn: Turn { axis: Vec3::ZERO, w: 1.0 }, shift: Vec3::ZERO };

    /// A rotation about the mesh's origin, followed by a shift (mm).
    ///
    /// # Errors
    /// [`PoseError`]: a number is not finite or too large, or the quaternion is not a rotation.
    pub fn new(rotation: Quat, shift: Vec3) -> Result<Self, PoseError> {
        let pose = Self::kept(rotation, shift);
        if !(pose.turn.axis.is_finite() && pose.turn.w.is_finite() && shift.is_finite()) {
            return Err(PoseError::NotFinite);
        }
        let squared = pose.turn.squared();
        // False for a square that is not finite.
        if !((squared - 1.0).abs() <= MOST_OFF) {
            return Err(PoseError::NoRotation { squared });
        }
        for value in shift.to_array() {
            if value.abs() > MAX_COORDINATE / 4.0 {
                return Err(PoseError::TooFar { value });
            }
        }
        Ok(pose)
    }

    /// A pose that was checked before.
    pub(crate) fn kept(rotation: Quat, shift: Vec3) -> Self {
        let [x, y, z, w] = rotation.to_array();
        Self { turn: Turn { axis: Vec3::new(x, y, z), w }, shift }
    }

    /// The rotation, as a quaternion of length 1 within 2^-20.
    #[must_use]
    pub fn rotation(&self) -> Quat {
        let Turn { axis: Vec3 { x, y, z }, w } = self.turn;
        Quat::from_xyzw(x, y, z, w)
    }

    /// The shift (mm).
    #[must_use]
    pub const fn shift(&self) -> Vec3 {
        self.shift
    }

    /// Transforms a point from mesh to world coordinates.
    #[must_use]
    pub fn apply(&self, point: Vec3) -> Vec3 {
        self.turn.apply(point) + self.shift
    }

    /// Transforms a point from world to mesh coordinates.
    #[must_use]
    pub fn apply_inverse(&self, point: Vec3) -> Vec3 {
        self.turn.inverse().apply(point - self.shift)
    }

    /// Rotates a vector from mesh to world coordinates.
    #[must_use]
    pub fn rotate(&self, vector: Vec3) -> Vec3 {
        self.turn.apply(vector)
    }

    /// Rotates a vector from world to mesh coordinates.
    #[must_use]
    pub fn rotate_inverse(&self, vector: Vec3) -> Vec3 {
        self.turn.inverse().apply(vector)
    }
}

/// A rotation, as a quaternion of any length. (glam's own gives other bits on processors with vector registers.)
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Turn {
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    axis: Vec3,
    w: f32,
}

impl Turn {
    fn squared(&self) -> f32 {
        self.axis.length_squared() + self.w * self.w
    }

    fn inverse(&self) -> Self {
        Self { axis: -self.axis, w: self.w }
    }

    /// The rotated vector minus the vector: small for small rotations, and so is its rounding.
    fn adds(&self, vector: Vec3) -> Vec3 {
        let across = self.axis.cross(vector);
        (across * self.w + self.axis.cross(across)) * (2.0 / self.squared())
    }

    fn apply(&self, vector: Vec3) -> Vec3 {
        vector + self.adds(vector)
    }
}

#[cfg(all(test, feature = "control"))]
mod tests;

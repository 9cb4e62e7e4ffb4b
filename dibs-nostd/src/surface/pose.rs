//! Where a mesh is as a whole: a rotation and a shift, checked, and what they are between two frames and beyond.
//!
//! Quaternions are kept as they came, of any length near one: every rotation divides by its square. So a check costs no
//! rounding.

use core::fmt;

use glam::{Quat, Vec3};

use crate::MAX_COORDINATE;
use crate::math::sqrt::sqrt;

/// Half a unit in the last place of one.
const HALF_UNIT: f32 = 1.0 / 16_777_216.0;

/// Most by which the square of a quaternion's length may differ from one.
const MOST_OFF: f32 = 1.0 / 1_048_576.0;

/// Sine of half the largest angle (0.5 rad) of a step that goes on beyond its frames.
const MOST_SINE: f32 = 0.247_404;

/// Where a mesh is as a whole: its point `p` is at `rotation p + shift`.
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

/// Why numbers are no rigid pose.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PoseError {
    /// A number is infinite or not a number.
    NotFinite,
    /// The quaternion is no rotation's: the square of its length is not within 2^-20 of 1.
    NoRotation {
        /// The square of its length.
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
    /// The mesh's own frame.
    pub const IDENTITY: Self = Self { turn: Turn { axis: Vec3::ZERO, w: 1.0 }, shift: Vec3::ZERO };

    /// A rotation about the mesh's origin, and then a shift (mm).
    ///
    /// # Errors
    /// [`PoseError`]: a number that is not finite or too large, or no rotation.
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

    /// Where a point of the mesh is.
    #[must_use]
    pub fn apply(&self, point: Vec3) -> Vec3 {
        self.turn.apply(point) + self.shift
    }

    /// The point of the mesh that is there.
    #[must_use]
    pub fn apply_inverse(&self, point: Vec3) -> Vec3 {
        self.turn.inverse().apply(point - self.shift)
    }

    /// Where a vector of the mesh points.
    #[must_use]
    pub fn rotate(&self, vector: Vec3) -> Vec3 {
        self.turn.apply(vector)
    }

    /// The vector of the mesh that points there.
    #[must_use]
    pub fn rotate_inverse(&self, vector: Vec3) -> Vec3 {
        self.turn.inverse().apply(vector)
    }

    /// Most (mm, rounded up) that any point within `lever` of `centre` moves from here to another pose.
    ///
    /// A point `c + y` of the mesh moves by `(B c - A c) + (M - 1) A y`: the centre's own way, and what the rotation `M`
    /// from one pose to the other makes of the arm `y`, which has the same length in both. A rotation by an angle moves the
    /// end of an arm by at most `2 sin(angle / 2)` of its length: exactly that where the arm is square to the axis. So the
    /// sum is a bound, and the least one where the centre's way is along that.
    pub(crate) fn step(&self, to: &Self, centre: Vec3, lever: f32) -> f32 {
        if self == to {
            return 0.0;
        }
        let turn = to.turn.after(&self.turn);
        let chord = 2.0 * sqrt(turn.axis.length_squared() / turn.squared());
        let way = (to.shift - self.shift) + turn.adds(self.turn.apply(centre));
        let moved = length(way) + chord * lever;
        // The quaternion between is off by 7 halves of a unit, so the chord is by 14, and the centre's arm by as much and by
        // the rounding of two rotations.
        moved * (1.0 + 16.0 * HALF_UNIT) + (lever + length(centre)) * (64.0 * HALF_UNIT)
    }

    /// Most (mm) by which a point is off that [`apply_inverse`](Self::apply_inverse) gives, of a pose that came so.
    ///
    /// Each product of the cross products and each of their sums is rounded: in halves of a unit of the vector's length the
    /// first cross product is off by 3, the second by 7, both together, with the factor before them, by less than 30, the sum
    /// and the difference before by one each.
    pub(crate) fn rounding(local: Vec3) -> f32 {
        size(local) * (34.0 * HALF_UNIT)
    }
}

/// The motion from one pose to the next: about the mesh's centre, which goes straight, evenly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseStep {
    after: RigidPose,
    centre: Vec3,
    /// The centre's arm from the mesh's origin, turned as it is at the end.
    arm: Vec3,
    /// Half of the rotation vector.
    half: Vec3,
    /// The centre's way.
    way: Vec3,
}

impl PoseStep {
    /// The step between two poses of a mesh with this centre; `None` if it turns by more than half a radian.
    pub(crate) fn between(before: &RigidPose, after: &RigidPose, centre: Vec3) -> Option<Self> {
        let turn = after.turn.after(&before.turn);
        // The shorter of the two ways round.
        let length = sqrt(turn.squared());
        let vector = turn.axis * (1.0 / if turn.w < 0.0 { -length } else { length });
        let square = vector.length_squared();
        // False for NaN.
        if !(square <= MOST_SINE * MOST_SINE) {
            return None;
        }
        // Taylor's polynomial of the inverse sine, divided by the sine.
        let third = 1.0 + square * (25.0 / 42.0) * (1.0 + square * (49.0 / 72.0));
        let ratio = 1.0 + square * (1.0 / 6.0) * (1.0 + square * (9.0 / 20.0) * third);
        Some(Self {
            after: *after,
            centre,
            arm: after.turn.apply(centre),
            half: vector * ratio,
            way: (after.shift - before.shift) + turn.adds(before.turn.apply(centre)),
        })
    }

    /// The pose a part of the step beyond its end, -1 to 2; exactly the last one for 0.
    pub(crate) fn beyond(&self, part: f32) -> RigidPose {
        if part == 0.0 {
            return self.after;
        }
        let half = self.half * part;
        let square = half.length_squared();
        // Taylor's polynomials of the sine, divided by its angle, and of the cosine.
        let sine = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
        let fourth = 1.0 - square / 30.0 * (1.0 - square / 56.0);
        let cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * fourth);
        let turn = Turn { axis: half * sine, w: cosine };
        let shift = self.after.shift + (self.way * part - turn.adds(self.arm));
        RigidPose { turn: turn.times(&self.after.turn), shift }
    }

    /// Most (mm) by which a point is off that the inverse of a pose of this step gives.
    ///
    /// In halves of a unit: the quaternion of the step is off by 11 at most, so that beyond by 22, which turn by 44; the
    /// product with the last one turns by 16 more. The centre's way is off by 46 of its arm, so by 92 beyond, and what the
    /// turn adds to the arm by 30. The shift's sums are rounded, too; and the inverse, as for a pose that came so.
    pub(crate) fn rounding(&self, local: Vec3, pose: &RigidPose) -> f32 {
        if *pose == self.after {
            return RigidPose::rounding(local);
        }
        let parts = 100.0 * size(local) + 168.0 * size(self.centre) + 4.0 * size(pose.shift);
        (parts + 4.0 * size(self.way)) * HALF_UNIT
    }

    /// The velocity (mm in the time of a step) of a point of the mesh that is at `point`, that part of the step beyond its end.
    pub(crate) fn velocity(&self, part: f32, point: Vec3) -> Vec3 {
        let centre = self.after.shift + self.arm + self.way * part;
        (self.half * 2.0).cross(point - centre) + self.way
    }
}

/// A rotation, as a quaternion of any length. (glam's own has other bits on processors with vectors.)
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

    /// What the rotation adds to a vector: the less it turns, the smaller, and the smaller is its rounding.
    fn adds(&self, vector: Vec3) -> Vec3 {
        let across = self.axis.cross(vector);
        (across * self.w + self.axis.cross(across)) * (2.0 / self.squared())
    }

    fn apply(&self, vector: Vec3) -> Vec3 {
        vector + self.adds(vector)
    }

    /// This rotation after another one.
    fn times(&self, first: &Self) -> Self {
        Self {
            axis: first.axis * self.w + self.axis * first.w + self.axis.cross(first.axis),
            w: self.w * first.w - self.axis.dot(first.axis),
        }
    }

    /// The rotation that leads from another one to this.
    fn after(&self, first: &Self) -> Self {
        self.times(&first.inverse())
    }
}

fn length(vector: Vec3) -> f32 {
    sqrt(vector.length_squared())
}

/// The sum of the coordinates' absolute values, at least the length.
fn size(vector: Vec3) -> f32 {
    vector.abs().element_sum()
}

#[cfg(test)]
mod tests;

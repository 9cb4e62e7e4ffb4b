//! The motion of a rigid instrument in a period.

use glam::Vec3;

use super::nearest::Vector;
use crate::math::order::smaller_or_nan;
use crate::math::sqrt::sqrt;

/// A motion of a rigid instrument in one period: its reference point moves in a straight line by `translation`, while
/// the instrument turns about it by `rotation`, both at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RigidMotion {
    /// The reference point before the motion (mm).
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub about: Vec3,
    /// The reference point's displacement (mm).
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub translation: Vec3,
    /// The rotation vector: the axis, times the angle in radians. A filter admits half a radian at most.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub rotation: Vec3,
}

/// Largest angle (rad) of a period.
const MOST_TURN: f32 = 0.5;

impl RigidMotion {
    /// A translation. Its reference point is the origin, about which a filter may turn the instrument: use
    /// [`new`](Self::new) for a point of the instrument.
    #[must_use]
    pub const fn translation(translation: Vec3) -> Self {
        Self { about: Vec3::ZERO, translation, rotation: Vec3::ZERO }
    }

    /// A translation, and a rotation about the point `about`.
    #[must_use]
    pub const fn new(about: Vec3, translation: Vec3, rotation: Vec3) -> Self {
        Self { about, translation, rotation }
    }

    /// A point of the instrument after the motion, for angles of up to half a radian.
    ///
    /// Cost: some 50 f32 operations; the same bits on every processor.
    #[must_use]
    pub fn apply(&self, point: Vec3) -> Vec3 {
        let arm = point - self.about;
        let square = self.rotation.length_squared();
        // Taylor's polynomials of sin x / x and (1 - cos x) / x^2.
        let sine = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
        let cosine = 0.5 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
        let across = self.rotation.cross(arm);
        let moved = self.translation + across * sine + self.rotation.cross(across) * cosine;
        point + moved
    }

    /// Upper bound (mm) on the deviation of a point of the instrument, `arm` mm from the reference point, from its
    /// straight path: the height of an arc.
    pub(super) fn arc(&self, arm: f32) -> f32 {
        arm * self.rotation.length_squared() * (1.0 / 8.0 + 1e-3)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.about.is_finite() && self.translation.is_finite() && self.rotation.is_finite()
    }

    /// The six unknowns, with rotations as lengths at the end of a lever.
    pub(super) fn to_vector(self, lever: f32) -> Vector {
        let (t, r) = (self.translation, self.rotation * lever);
        [t.x, t.y, t.z, r.x, r.y, r.z]
    }

    pub(super) fn from_vector(about: Vec3, vector: &Vector, lever: f32) -> Self {
        let [x, y, z, a, b, c] = *vector;
        Self {
            about,
            translation: Vec3::new(x, y, z),
            rotation: Vec3::new(a / lever, b / lever, c / lever),
        }
    }
}

/// The vector, shortened to at most `most` up to rounding.
pub(super) fn shortened(vector: Vec3, most: f32) -> Vec3 {
    let length = sqrt(vector.length_squared());
    if length > most * (1.0 + 8.0 * f32::EPSILON) { vector * (most / length) } else { vector }
}

/// Largest angle (rad) of a period.
pub(super) fn most_turn(most: f32, lever: f32) -> f32 {
    smaller_or_nan(most / lever, MOST_TURN)
}

/// The largest fraction of a step, at most 1, after which a point that starts within `most` of the origin still is.
pub(super) fn inside(start: Vec3, step: Vec3, most: f32) -> f32 {
    let (square, along) = (step.length_squared(), start.dot(step));
    let room = most * most - start.length_squared();
    if start.distance_squared(-step) <= most * most || !(square > 0.0) {
        return 1.0;
    }
    let root = along * along + square * room;
    // Written so that NaN gives 0.
    if room > 0.0 && root > 0.0 {
        smaller_or_nan((sqrt(root) - along) / square * (1.0 - 8.0 * f32::EPSILON), 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_point_that_starts_too_far_goes_nowhere() {
        assert_eq!(inside(Vec3::X, Vec3::X * 2.0, 2.0), (1.0 - 8.0 * f32::EPSILON) * 0.5);
        assert_eq!(inside(Vec3::X * 3.0, Vec3::X, 2.0), 0.0);
        // It leads in.
        assert_eq!(inside(Vec3::X * 3.0, Vec3::X * -2.0, 2.0), 1.0);
        // No step, and one whose square's square f32 does not hold.
        assert_eq!(inside(Vec3::X * 3.0, Vec3::ZERO, 2.0), 1.0);
        assert_eq!(inside(Vec3::ZERO, Vec3::X * 1e-20, 1e-21), 0.0);
    }

    proptest! {
        /// Against f64, and on its whole path no farther from the straight line than the arc's height.
        #[test]
        fn a_motion_turns_about_its_point(
            about in prop::array::uniform3(-50.0_f32..50.0), by in prop::array::uniform3(-2.0_f32..2.0),
            axis in prop::array::uniform3(-1.0_f32..1.0), angle in 0.0_f32..0.5, point in prop::array::uniform3(-90.0_f32..90.0),
        ) {
            let axis = Vec3::from(axis).normalize_or_zero();
            let motion = RigidMotion::new(about.into(), by.into(), axis * angle);
            let point = Vec3::from(point);
            let at = |s: f64| {
                let turn = DQuat::from_scaled_axis(motion.rotation.as_dvec3() * s);
                let about = motion.about.as_dvec3();
                about + turn * (point.as_dvec3() - about) + motion.translation.as_dvec3() * s
            };
            let moved: DVec3 = motion.apply(point).as_dvec3();
            prop_assert!(moved.distance(at(1.0)) < 1e-4, "{moved} {}", at(1.0));
            let arc = f64::from(motion.arc(point.distance(motion.about))) + 1e-5;
            for step in 0..=10 {
                let s = f64::from(step) / 10.0;
                let straight = at(0.0).lerp(at(1.0), s);
                prop_assert!(straight.distance(at(s)) <= arc, "{arc}");
            }
        }
    }
}

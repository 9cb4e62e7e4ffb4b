//! The step from one pose to the next: the motion of points, poses between and beyond frames, and rounding.

use glam::Vec3;

use super::{RigidPose, Turn};
use crate::math::round::U;
use crate::math::sqrt::sqrt;

/// Sine of half the largest angle (0.5 rad) of an extrapolated step.
pub(super) const MOST_SINE: f32 = 0.247_404;

impl RigidPose {
    /// Upper bound (mm, rounded up) on the motion of any point within `lever` of `centre` from here to another pose.
    ///
    /// A point `c + y` of the mesh moves by `(B c - A c) + (M - 1) A y`: the centre's own displacement, plus the effect
    /// of the rotation `M` from one pose to the other on the arm `y`, which has the same length in both. A rotation by
    /// an angle moves the end of an arm by at most `2 sin(angle / 2)` of its length, exactly that if the arm is
    /// perpendicular to the axis. So the sum is a bound, and the least one if the centre moves in the same direction.
    pub(crate) fn step(&self, to: &Self, centre: Vec3, lever: f32) -> f32 {
        if self == to {
            return 0.0;
        }
        let turn = to.turn.after(&self.turn);
        let chord = 2.0 * sqrt(turn.axis.length_squared() / turn.squared());
        let shifted = (to.shift - self.shift) + turn.adds(self.turn.apply(centre));
        let moved = length(shifted) + chord * lever;
        // The relative quaternion has an error of 7 half units, so the chord has 14; the centre's arm has the same plus
        // the rounding of two rotations.
        moved * (1.0 + 16.0 * U) + (lever + length(centre)) * (64.0 * U)
    }

    /// Upper bound (mm) on the rounding of a point from [`apply_inverse`](Self::apply_inverse), for a pose as received.
    ///
    /// Each product of the cross products and each of their sums is rounded. In half units of the vector's length the
    /// first cross product has an error of 3, the second of 7, both together with the factor before them less than 30;
    /// the sum and the difference before add one each.
    pub(crate) fn rounding(local: Vec3) -> f32 {
        size(local) * (34.0 * U)
    }
}

/// The motion from one pose to the next: about the mesh's centre, which moves in a straight line, at constant speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseStep {
    after: RigidPose,
    centre: Vec3,
    /// The vector from the mesh's origin to the centre, rotated as at the end.
    arm: Vec3,
    half: Vec3,
    shifted: Vec3,
}

impl PoseStep {
    /// The step between two poses of a mesh with this centre; `None` if it turns by more than half a radian.
    pub(crate) fn between(before: &RigidPose, after: &RigidPose, centre: Vec3) -> Option<Self> {
        let turn = after.turn.after(&before.turn);
        // The shorter of the two rotations.
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
            shifted: (after.shift - before.shift) + turn.adds(before.turn.apply(centre)),
        })
    }

    /// The pose at a fraction of the step beyond its end, -1 to 2; exactly the last pose for 0.
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
        let shift = self.after.shift + (self.shifted * part - turn.adds(self.arm));
        RigidPose { turn: turn.times(&self.after.turn), shift }
    }

    /// Upper bound (mm) on the rounding of a point from the inverse of a pose of this step.
    ///
    /// In half units: the step's quaternion has an error of at most 11, so 22 beyond the end, which turn by 44; the
    /// product with the last quaternion turns by 16 more. The centre's displacement has an error of 46 of its arm, so
    /// 92 beyond the end, and the rotation of the arm adds 30. The shift's sums are rounded, too; and the inverse, as
    /// for a received pose.
    pub(crate) fn rounding(&self, local: Vec3, pose: &RigidPose, part: f32) -> f32 {
        let turned = self.rounding_of_vector(local, part);
        if part == 0.0 {
            return turned;
        }
        let parts = 168.0 * size(self.centre) + 4.0 * (size(pose.shift) + size(self.shifted));
        turned + parts * U
    }

    /// The same for a vector, which the shift does not change.
    pub(crate) fn rounding_of_vector(&self, local: Vec3, part: f32) -> f32 {
        if part == 0.0 {
            return RigidPose::rounding(local);
        }
        size(local) * (100.0 * U)
    }

    /// The velocity (mm per step time) of a mesh point at `point`, at this fraction of the step beyond its end.
    pub(crate) fn velocity(&self, part: f32, point: Vec3) -> Vec3 {
        let centre = self.after.shift + self.arm + self.shifted * part;
        (self.half * 2.0).cross(point - centre) + self.shifted
    }
}

impl Turn {
    /// This rotation after another one.
    fn times(&self, first: &Self) -> Self {
        Self {
            axis: first.axis * self.w + self.axis * first.w + self.axis.cross(first.axis),
            w: self.w * first.w - self.axis.dot(first.axis),
        }
    }

    /// The rotation from another one to this one.
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

//! Where a mesh is as a whole, from Python's frame.

use dibs_build::glam::{DQuat, DVec3};
use dibs_nostd::glam::{Quat, Vec3};

/// A rotation, x, y, z and w, and a shift (mm).
pub type PoseParts = ([f64; 4], [f64; 3]);

/// The pose of positions that count from the tree's origin.
pub fn local((rotation, shift): PoseParts, origin: DVec3) -> (Quat, Vec3) {
    let rotation = DQuat::from_array(rotation);
    let shift = DVec3::from(shift) + (rotation.normalize() * origin - origin);
    (rotation.as_quat(), shift.as_vec3())
}

//! The pose of a mesh as a whole.

use bytemuck::AnyBitPattern;
use dibs_nostd::glam::{Quat, Vec3};

use crate::tool::dibs_vec3;

/// A rigid pose of a mesh: its point `p` is at `rotation p + shift`.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_pose {
    /// A quaternion x, y, z, w; the square of its length is within 2^-20 of 1.
    pub rotation: [f32; 4],
    /// In mm.
    pub shift: dibs_vec3,
}

impl From<dibs_pose> for (Quat, Vec3) {
    fn from(pose: dibs_pose) -> Self {
        (Quat::from_array(pose.rotation), pose.shift.into())
    }
}

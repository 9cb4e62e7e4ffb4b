//! The poses of the buffers' frames, from the bus to the control tick.
//!
//! The state word that publishes a frame publishes its pose as well: the writer stores a pose before it publishes, and
//! only for the buffer that nobody reads. (`tests/soundness` tries every order.)

// Requirements: F-01, F-08

use glam::{Quat, Vec3};

use super::rows::SharedState;
use crate::math::order::larger;
use crate::surface::PoseStep;
use crate::surface::{AtomicU32, Ordering};
use crate::{FrameGuard, RigidPose};

/// The poses of the three buffers, and the distance (mm) of each from the extrapolation before it.
#[doc(hidden)]
#[derive(Debug)]
pub struct Poses([[AtomicU32; 8]; 3]);

#[cfg(not(loom))]
impl SharedState for Poses {
    const NEW: Self = Self([const { [const { AtomicU32::new(0) }; 8] }; 3]);
}

/// For a model checker, whose atomics are no constants.
#[cfg(loom)]
impl SharedState for Poses {
    fn new() -> Self {
        use core::array::from_fn;
        Self(from_fn(|_| from_fn(|_| AtomicU32::new(0))))
    }
}

impl Poses {
    /// Stores the pose of the buffer with this number.
    pub fn set(&self, buffer: u32, pose: &RigidPose, residual: f32) {
        let ([x, y, z, w], [a, b, c]) = (pose.rotation().to_array(), pose.shift().to_array());
        let Some(words) = self.0.get(buffer as usize) else { return };
        for (word, value) in words.iter().zip([x, y, z, w, a, b, c, residual]) {
            word.store(value.to_bits(), Ordering::Relaxed);
        }
    }

    /// Whether both the previous frame and the last one are without a pose.
    pub(super) fn are_none(&self, published: &FrameGuard<'_>) -> bool {
        let [(before, _), (last, _)] = self.of_frames(published);
        let no_frame = RigidPose::kept(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Vec3::ZERO);
        last == RigidPose::IDENTITY && [RigidPose::IDENTITY, no_frame].contains(&before)
    }

    pub(super) fn last(&self, published: &FrameGuard<'_>) -> RigidPose {
        let [_, (last, _)] = self.of_frames(published);
        last
    }

    /// The step to extrapolate, and the larger residual of the last two frames; `None` if there is no extrapolation.
    pub(super) fn step(&self, published: &FrameGuard<'_>, centre: Vec3) -> Option<(PoseStep, f32)> {
        let [(before, earlier), (last, residual)] = self.of_frames(published);
        let step = PoseStep::between(&before, &last, centre)?;
        // A single small residual may be by chance. False for NaN.
        let residual = larger(residual, earlier);
        (residual >= 0.0).then_some((step, residual))
    }

    /// The poses of the previous frame and of the published one.
    pub fn of_frames(&self, published: &FrameGuard<'_>) -> [(RigidPose, f32); 2] {
        let last = published.number();
        let before = if last == 0 { 2 } else { last - 1 };
        [before, last].map(|buffer| {
            let Some(words) = self.0.get(buffer as usize) else {
                return (RigidPose::IDENTITY, f32::NAN);
            };
            let [x, y, z, w, a, b, c, residual] =
                words.each_ref().map(|word| f32::from_bits(word.load(Ordering::Relaxed)));
            (RigidPose::kept(Quat::from_xyzw(x, y, z, w), Vec3::new(a, b, c)), residual)
        })
    }
}

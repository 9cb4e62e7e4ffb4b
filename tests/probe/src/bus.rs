//! The protocol between the fault matrix and the receiver on the board, and what both receivers have in common.

use dibs_nostd::guard::{PosedRows, Poses, Rows};
use dibs_nostd::{FrameGuard, RigidPose, SurfaceLimits, Tree, VertexTable};

/// Vertices of the surface.
pub const VERTICES: usize = 66;
/// Largest packet to the board, in bytes: so small that a frame takes several packets.
pub const MTU: usize = 128;
/// Triangles checked, or rows copied, in one slice.
pub const WORK: u32 = 64;
/// Largest status packet, in bytes: with every counter.
pub const REPORT_MTU: usize = 200;
/// Bytes of a report before its status: bytes received, frames published, epoch, digest.
pub const HEAD_BYTES: usize = 16;
/// The key of both sides.
pub const KEY: [u8; 16] = *b"sixteen bytes...";
/// The receiver's id.
pub const RECEIVER: u32 = 7;

/// The check of a frame, which may have a pose.
pub type PoseCheck<'s, 't> = <PosedRows as Rows>::AdmissionCheck<'s, 't, u16>;

/// A new check.
#[must_use]
pub fn admission_check<'s, 't>(
    tree: &Tree<'t, u16>,
    poses: &'s Poses,
) -> Option<PoseCheck<'s, 't>> {
    let limits = SurfaceLimits::reach_mm(1e3).speed(1e3);
    let rows = <PosedRows as Rows>::of(tree).ok()?;
    <PosedRows as Rows>::admission_check(tree, &rows, limits, poses).ok()
}

/// A pose's numbers: of its rotation, then of its shift.
pub fn pose_numbers(pose: RigidPose) -> impl Iterator<Item = f32> {
    pose.rotation().to_array().into_iter().chain(pose.shift().to_array())
}

/// The words of a published frame, those of its pose last.
pub fn published_words(frame: &FrameGuard<'_>, poses: &Poses) -> impl Iterator<Item = u32> {
    let [_, (pose, _)] = poses.of_frames(frame);
    let positions =
        (0..VERTICES as u32).flat_map(|row| frame.position(row).unwrap_or_default().to_array());
    positions.chain(pose_numbers(pose)).map(f32::to_bits)
}

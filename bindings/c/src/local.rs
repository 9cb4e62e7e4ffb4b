//! Whole frames of this process, without packets.

use dibs_nostd::Millis;
use dibs_nostd::modes::Modes;

use crate::border::{Handle, Input};
use crate::bus::{TheBus, dibs_bus, with_bus};
use crate::code::dibs_code;
use crate::frame::rows;
use crate::pose::dibs_pose;
use crate::tree::dibs_tree;

/// Receives a whole frame from this process, for example from a solver's own thread. `dibs_bus_work` then checks and
/// publishes it like a frame of packets.
///
/// The call counts as a good packet, and the frame's transit time is 0. Use one source at a time: an unfinished frame
/// of packets is abandoned. There is no lock: the control tick reads the last surface meanwhile.
///
/// Cost: linear in the vertices, each of which is read several times.
///
/// @param bus        The bus.
/// @param positions  x, y and z (mm, less the tree's origin) of each vertex of the mesh's file, in that file's order.
///                   Read during the call.
/// @param count      Their number: the vertices of the mesh's file.
/// @param captured   Time of capture on the receiver's clock, in ms: at most 65,534 before `now`.
/// @param now        The receiver's clock, in ms; wraps.
/// @return `DIBS_CODE_OK`, a cause of refusal as from `dibs_receiver_accept` (the last good surface stays), or a
///         misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_frame(
    bus: *mut dibs_bus,
    positions: *const f32,
    count: u32,
    captured: u32,
    now: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (mut bus, rows) = (bus.open()?, rows(positions, count)?);
        let _ = with_bus!(&mut bus.0, |bus| bus.frame(rows, Millis(captured), Millis(now)))?;
        Ok(())
    })
}

/// The same as `dibs_bus_frame`, with a rigid pose of the whole mesh, for example from a tracker of the patient: tools,
/// answers and commands are then in world coordinates. Without a pose the mesh is where its file has it.
///
/// The limits on speed and recovery apply to positions and pose together; the reach applies to the positions alone. If
/// a step rotates by more than half a radian, the surface is held at the last frame, not extrapolated.
///
/// @param bus        The bus.
/// @param positions  As for `dibs_bus_frame`.
/// @param count      Their number.
/// @param pose       The pose, read during the call.
/// @param captured   Time of capture of positions and pose.
/// @param now        The receiver's clock, in ms; wraps.
/// @return As `dibs_bus_frame`; `DIBS_CODE_PACKET_NOT_FINITE`, `DIBS_CODE_PACKET_TOO_FAR` or `DIBS_CODE_PACKET_FORM`
///         for an invalid pose.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_frame_at(
    bus: *mut dibs_bus,
    positions: *const f32,
    count: u32,
    pose: *const dibs_pose,
    captured: u32,
    now: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (pose, mut bus, rows) = (pose.get()?, bus.open()?, rows(positions, count)?);
        let (captured, now) = (Millis(captured), Millis(now));
        let _ = with_bus!(&mut bus.0, |bus| bus.frame_at(rows, pose.into(), captured, now))?;
        Ok(())
    })
}

/// The same as `dibs_bus_frame`, by the weights of the tree's displacement modes (`dibs build --motion --modes`), with
/// or without a pose. All vertices are computed, and the modes' own error is part of each answer's accuracy.
///
/// Cost: linear in vertices times modes, several times.
///
/// @param bus       The bus.
/// @param tree      Its tree.
/// @param weights   The weight of each mode, read during the call.
/// @param count     Their number.
/// @param pose      The pose of the whole mesh, as for `dibs_bus_frame_at`, or null.
/// @param captured  As for `dibs_bus_frame`.
/// @param now       The receiver's clock, in ms; wraps.
/// @return As `dibs_bus_frame_at`; `DIBS_CODE_TREE_NO_MODES`; `DIBS_CODE_PACKET_ROWS` for another number of weights than
///         modes; `DIBS_CODE_PACKET_NOT_FINITE`; `DIBS_CODE_PACKET_TOO_FAR` for a weight out of its range;
///         `DIBS_CODE_PACKET_MESH` for another tree than the bus's.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_weights(
    bus: *mut dibs_bus,
    tree: *mut dibs_tree,
    weights: *const f32,
    count: u32,
    pose: *const dibs_pose,
    captured: u32,
    now: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (pose, tree, mut bus) = (pose.get_if_any()?, tree.share()?, bus.open()?);
        let (modes, weights) = (&Modes::of(&tree.tree)?, weights.slice(count as usize)?);
        let (captured, now) = (Millis(captured), Millis(now));
        let _ = with_bus!(&mut bus.0, |bus| match pose {
            Some(pose) => bus.frame_of_weights_at(modes, weights, pose.into(), captured, now),
            None => bus.frame_of_weights(modes, weights, captured, now),
        })?;
        Ok(())
    })
}

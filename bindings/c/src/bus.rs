//! The bus's end of a guarded surface.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{Bus, Rows};
use dibs_nostd::wire::{Event, NoMac};
use dibs_nostd::{Advance, Millis, Progress, ReceiveError, TreeBytes, VertexTable};

use crate::border::{Handle, Input, Kind, Output, Place, Storage};
use crate::code::dibs_code;
use crate::frame::rows;
use crate::limits::dibs_guard_limits;
use crate::receiver::{DIBS_EVENTS, DIBS_STATUS, dibs_advance, dibs_progress};
use crate::surface::{OfNodes, OfVertices, dibs_surface};
use crate::tool::dibs_vec3;
use crate::tree::dibs_tree;

/// Bytes of a bus's storage.
pub const DIBS_BUS_SIZE: usize = 3_072;

/// The bus's end of a guarded surface: it takes packets, checks complete frames in slices, publishes them, watches the
/// tree's bytes, and makes the statuses that go back.
///
/// Two contexts may use it, one at a time: an interrupt that takes bytes, and an idle loop that works. Both are below the
/// control tick's priority. The interrupt gets `DIBS_CODE_IN_USE` where it meets the loop at work: it keeps its bytes for
/// later, or the loop works with the interrupt masked.
pub struct dibs_bus(TheBus);

/// Of frames of vertices, or of the nodes that carry the surface.
#[expect(
    clippy::large_enum_variant,
    reason = "its storage has one size, and there is no allocator"
)]
enum TheBus {
    Vertices(Bus<'static, 'static, u16, NoMac, OfVertices>),
    Nodes(Bus<'static, 'static, u16, NoMac, OfNodes>),
}

/// Calls a function of the bus, of either kind.
macro_rules! with_bus {
    ($bus:expr, |$own:ident| $call:expr) => {
        match $bus {
            TheBus::Vertices($own) => $call,
            TheBus::Nodes($own) => $call,
        }
    };
}

impl TheBus {
    const STATUS_BYTES: usize = Bus::<'static, 'static, u16>::STATUS_BYTES;
    const STATUS_FRAMED: usize = Bus::<'static, 'static, u16>::STATUS_FRAMED;

    fn packet(&mut self, packet: &[u8], now: Millis) -> Result<Progress, ReceiveError> {
        with_bus!(self, |bus| bus.packet(packet, now))
    }

    fn work(&mut self, most: u32) -> Result<Advance, ReceiveError> {
        with_bus!(self, |bus| bus.work(most))
    }
}

const _: () = assert!(TheBus::STATUS_FRAMED == DIBS_STATUS);

impl Kind for dibs_bus {
    const MARK: u32 = 0x6462_6216;
    const SIZE: usize = DIBS_BUS_SIZE;
}

/// Makes the bus's end of a surface, once. `dibs_start` makes it with all that it needs.
///
/// @param storage  `DIBS_BUS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param surface  The surface, in `DIBS_GUARDED_SIZE(vertices)` bytes.
/// @param tree     Its tree.
/// @param limits   The guard's limits: the same as for `dibs_guard_init`.
/// @param bus      Receives the bus's address.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` where surface and tree have not as many rows; `DIBS_CODE_STORAGE_SIZE`
///         also where the surface has room for two buffers alone; `DIBS_CODE_TAKEN` where its end was taken;
///         `DIBS_CODE_TREE_NO_METRIC`; `DIBS_CODE_TREE_NO_REST_SHAPE` where the limits need one; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_init(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_guard_limits,
    bus: *mut *mut dibs_bus,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, bus, || {
            let (surface, tree, limits) = (surface.share()?, tree.share()?, limits.get()?.read()?);
            surface.check_guarded(tree.rows())?;
            let (bytes, notes) = (TreeBytes::new(tree.bytes), &surface.notes);
            let bus = surface.with_writer(|writer| match &tree.nodes {
                None => {
                    let tree = (&tree.tree, bytes, &OfVertices::of(&tree.tree)?);
                    Ok(TheBus::Vertices(Bus::new(notes, writer, tree, &limits, NoMac)?))
                }
                Some(_) => {
                    let tree = (&tree.tree, bytes, &OfNodes::of(&tree.tree)?);
                    Ok(TheBus::Nodes(Bus::new(notes, writer, tree, &limits, NoMac)?))
                }
            });
            Ok(dibs_bus(bus?))
        })
    })
}

/// Takes bytes of a serial line or another stream. `dibs_bus_counters` says what became of them, by cause.
///
/// Cost: linear in the bytes. `dibs_bus_work` must keep up: a complete frame is dropped where the next one begins
/// before it was checked.
///
/// @param bus     The bus.
/// @param bytes   The bytes, read during the call.
/// @param length  Their number.
/// @param now     The receiver's clock, in ms; wraps.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_receive(
    bus: *mut dibs_bus,
    bytes: *const u8,
    length: usize,
    now: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (bytes, mut bus) = (bytes.slice(length)?, bus.open()?);
        with_bus!(&mut bus.0, |bus| bus.receive(bytes, Millis(now)));
        Ok(())
    })
}

/// Takes one packet, from a bus that keeps packets apart.
///
/// Cost: linear in the bytes.
///
/// @param bus       The bus.
/// @param packet    The packet, read during the call.
/// @param length    Its bytes.
/// @param now       The receiver's clock, in ms; wraps.
/// @param progress  Receives its outcome, or null.
/// @return As `dibs_receiver_accept`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_packet(
    bus: *mut dibs_bus,
    packet: *const u8,
    length: usize,
    now: u32,
    progress: *mut dibs_progress,
) -> dibs_code {
    dibs_code::of(|| {
        let (progress, mut bus) = (progress.check_if_any()?, bus.open()?);
        let outcome = bus.0.packet(packet.slice(length)?, Millis(now))?;
        Place::set_if_any(progress, outcome.into());
        Ok(())
    })
}

/// Takes a whole frame from this process, say from a solver's own thread. `dibs_bus_work` then checks and publishes it, as
/// one that came in packets.
///
/// The call counts as a sign of life, and its transit time is 0. One source at a time: a frame of packets that is in work
/// is abandoned. No lock: the control tick reads the last surface meanwhile.
///
/// Cost: linear in the vertices, several readings each.
///
/// @param bus        The bus.
/// @param positions  x, y and z (mm, less the tree's origin) of each vertex of the mesh's file, in that file's order. Read
///                   during the call.
/// @param count      Their number: the vertices of the mesh's file.
/// @param captured   When the surface was so, on the receiver's clock, in ms: at most 65,534 before `now`.
/// @param now        The receiver's clock, in ms; wraps.
/// @return `DIBS_CODE_OK`, the cause of a refusal as `dibs_receiver_accept` (the last good surface stays), or a misuse.
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

/// Where a mesh is as a whole: its point `p` is at `rotation p + shift`.
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

/// The same as `dibs_bus_frame`, with the mesh as a whole elsewhere, say by a tracker of the patient: tools, answers and
/// commands are then in the world. A frame without a pose is where the mesh's file has it.
///
/// The limits on speed and recovery hold for positions and pose together; the reach is that of the positions alone. Where a
/// step turns by more than half a radian the surface is held, not extrapolated.
///
/// @param bus        The bus.
/// @param positions  As for `dibs_bus_frame`.
/// @param count      Their number.
/// @param pose       The pose, read during the call.
/// @param captured   When the surface was so, and there.
/// @param now        The receiver's clock, in ms; wraps.
/// @return As `dibs_bus_frame`; `DIBS_CODE_PACKET_NOT_FINITE`, `DIBS_CODE_PACKET_TOO_FAR` or `DIBS_CODE_PACKET_FORM` for
///         numbers that are no pose.
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

/// Does a slice of the checks: looks at some rows and triangles of the frame that arrives, and publishes it once it is
/// complete and admitted. Without a frame it checks the tree's bytes.
///
/// Cost: linear in `work`.
///
/// @param bus      The bus.
/// @param work     Most rows and triangles that are looked at.
/// @param advance  Receives the outcome, `DIBS_ADVANCE_PENDING` if more is due at once; or null.
/// @return As `dibs_receiver_advance`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_work(
    bus: *mut dibs_bus,
    work: u32,
    advance: *mut dibs_advance,
) -> dibs_code {
    dibs_code::of(|| {
        let (advance, mut bus) = (advance.check_if_any()?, bus.open()?);
        let outcome = bus.0.work(work)?;
        Place::set_if_any(advance, outcome.into());
        Ok(())
    })
}

/// Writes the status that is due for the sender, whose next frame echoes it, which measures the transit of frames.
/// Call it after each slice of work: none is due unless there is news, or 100 ms went by.
///
/// @param bus       The bus.
/// @param now       The receiver's clock, in ms.
/// @param framed    0 for a packet; otherwise a COBS frame with the zero that ends it, for a stream.
/// @param out       Receives it.
/// @param capacity  Bytes that there is room for: `DIBS_STATUS` at least.
/// @param length    Receives its length; 0 where none is due.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_status(
    bus: *mut dibs_bus,
    now: u32,
    framed: u32,
    out: *mut u8,
    capacity: usize,
    length: *mut usize,
) -> dibs_code {
    dibs_code::of(|| {
        let (length, out) = (length.check()?, out.places(capacity)?);
        // Before the status is made: one that has no room would be lost.
        if capacity < DIBS_STATUS {
            return Err(dibs_code::Capacity);
        }
        let (mut bus, mut packet) = (bus.open()?, [0; TheBus::STATUS_BYTES]);
        let mut line = [0; DIBS_STATUS];
        let status = if framed == 0 {
            with_bus!(&mut bus.0, |bus| bus.status(Millis(now), &mut packet))
        } else {
            with_bus!(&mut bus.0, |bus| bus.status_framed(Millis(now), &mut line))
        };
        length.set(out.fill(status.unwrap_or_default())?);
        Ok(())
    })
}

/// The count of each event since the start, in the order of `dibs_event_name`.
///
/// @param bus       The bus.
/// @param counters  Room for `DIBS_EVENTS` numbers.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_counters(bus: *mut dibs_bus, counters: *mut u32) -> dibs_code {
    dibs_code::of(|| {
        let (out, bus) = (counters.places(DIBS_EVENTS)?, bus.open()?);
        let all = with_bus!(&bus.0, |bus| bus.counters());
        out.fill(&Event::ALL.map(|event| all.of(event))).map(|_| ())
    })
}

/// Facts about a bus.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_bus_facts {
    /// 0 before the first frame; then the epoch is 0, too.
    pub is_published: u32,
    /// Number of the frame published last; wraps.
    pub epoch: u32,
    /// Whole rounds of the check of the tree's bytes; wraps.
    pub rounds: u32,
}

/// Reads the facts about a bus.
///
/// @param bus    The bus.
/// @param facts  Receives the facts.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_get_facts(bus: *mut dibs_bus, facts: *mut dibs_bus_facts) -> dibs_code {
    dibs_code::of(|| {
        let (facts, bus) = (facts.check()?, bus.open()?);
        let surface = with_bus!(&bus.0, |bus| bus.surface());
        let epoch = surface.and_then(|surface| surface.epoch());
        facts.set(dibs_bus_facts {
            is_published: epoch.is_some().into(),
            epoch: epoch.unwrap_or(0),
            rounds: with_bus!(&bus.0, |bus| bus.rounds()),
        });
        Ok(())
    })
}

/// Position (mm) of a vertex, or node, in the frame published last, for a checksum of the published rows, or a log.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, `DIBS_CODE_ARGUMENT` beyond the last vertex, or a
///         misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_position(
    bus: *mut dibs_bus,
    vertex: u32,
    position: *mut dibs_vec3,
) -> dibs_code {
    dibs_code::of(|| {
        let (place, bus) = (position.check()?, bus.open()?);
        let surface = with_bus!(&bus.0, |bus| bus.surface()).ok_or(dibs_code::NoSurface)?;
        place.set(surface.position(vertex).ok_or(dibs_code::Argument)?.into());
        Ok(())
    })
}

/// Registers the surface anew, as `dibs_receiver_register` does: only an operator decides that.
///
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_register(bus: *mut dibs_bus) -> dibs_code {
    dibs_code::of(|| {
        with_bus!(&mut bus.open()?.0, |bus| bus.register());
        Ok(())
    })
}

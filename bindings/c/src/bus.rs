//! The bus's end of a guarded surface.

use core::ffi::c_void;

use dibs_nostd::guard::{Bus, Rows};
use dibs_nostd::wire::{AesCmac, Event, Mac, NoMac};
use dibs_nostd::{Advance, Millis, Progress, ReceiveError, TreeBytes, VertexTable};

use crate::border::{Handle, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::limits::dibs_guard_limits;
use crate::outcome::{dibs_advance, dibs_progress};
use crate::receiver::{DIBS_EVENTS, DIBS_STATUS};
use crate::surface::{OfNodes, OfVertices, Poses, dibs_surface};
use crate::tags::dibs_tags;
use crate::tool::dibs_vec3;
use crate::tree::{Row, dibs_tree};

/// Bytes of a bus's storage.
pub const DIBS_BUS_SIZE: usize = 3_136;

/// The bus's end of a guarded surface: it receives packets, checks complete frames in slices, publishes them, checks
/// the tree's bytes in the background, and writes the statuses for the sender.
///
/// Two contexts may use it, one at a time: an interrupt that receives bytes, and an idle loop that checks. Both have a
/// lower priority than the control tick. The interrupt gets `DIBS_CODE_IN_USE` while the loop uses the bus: it then
/// keeps its bytes for later, or the loop masks the interrupt while it works.
pub struct dibs_bus(pub(crate) TheBus);

type OfRows<R, M> = Bus<'static, 'static, Row, M, R>;
type Variant<R, M> = fn(OfRows<R, M>) -> TheBus;
type Tags = &'static AesCmac;

/// For frames of vertices, or of the nodes that move the surface; in packets without tags, or with them.
pub(crate) enum TheBus {
    Vertices(OfRows<OfVertices, NoMac>),
    Nodes(OfRows<OfNodes, NoMac>),
    TaggedVertices(OfRows<OfVertices, Tags>),
    TaggedNodes(OfRows<OfNodes, Tags>),
}

/// Calls a function of the bus, of either kind.
macro_rules! with_bus {
    ($bus:expr, |$own:ident| $call:expr) => {
        match $bus {
            TheBus::Vertices($own) => $call,
            TheBus::Nodes($own) => $call,
            TheBus::TaggedVertices($own) => $call,
            TheBus::TaggedNodes($own) => $call,
        }
    };
}
pub(crate) use with_bus;

impl TheBus {
    const STATUS_BYTES: usize = Bus::<'static, 'static, Row>::STATUS_BYTES;
    const STATUS_FRAMED: usize = Bus::<'static, 'static, Row>::STATUS_FRAMED;

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

/// Makes the bus's end of a surface, once. `dibs_start` makes it together with all other objects.
///
/// @param storage  `DIBS_BUS_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param surface  The surface, in `DIBS_GUARDED_SIZE(vertices)` bytes.
/// @param tree     Its tree.
/// @param limits   The guard's limits: the same as for `dibs_guard_init`.
/// @param bus      Receives the bus's address.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of rows is not the tree's;
///         `DIBS_CODE_STORAGE_SIZE` also if the surface has only two buffers; `DIBS_CODE_TAKEN` if its end was taken;
///         `DIBS_CODE_TREE_NO_METRIC`; `DIBS_CODE_TREE_NO_REST_SHAPE` if the limits need one; or a misuse.
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
            bus_of(surface, tree, limits, NoMac, (TheBus::Vertices, TheBus::Nodes))
        })
    })
}

/// The same, for a sender with a key: a packet without a genuine tag is refused and counted.
///
/// @param storage  As for `dibs_bus_init`.
/// @param size     Bytes of the storage.
/// @param surface  The surface.
/// @param tree     Its tree.
/// @param limits   The guard's limits.
/// @param tags     The tags.
/// @param bus      Receives the bus's address.
/// @return As `dibs_bus_init`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_init_with_tags(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_guard_limits,
    tags: *mut dibs_tags,
    bus: *mut *mut dibs_bus,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, bus, || {
            let tags = tags.share()?.mac();
            bus_of(surface, tree, limits, tags, (TheBus::TaggedVertices, TheBus::TaggedNodes))
        })
    })
}

/// The bus of a tree's kind of rows, as one of these variants.
fn bus_of<M: Mac>(
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_guard_limits,
    mac: M,
    (vertices, nodes): (Variant<OfVertices, M>, Variant<OfNodes, M>),
) -> Result<dibs_bus, dibs_code> {
    let (surface, tree, limits) = (surface.share()?, tree.share()?, limits.get()?);
    Ok(dibs_bus(match tree.nodes {
        None => vertices(of_rows(surface, tree, limits, mac)?),
        Some(_) => nodes(of_rows(surface, tree, limits, mac)?),
    }))
}

fn of_rows<R: Rows<Poses = Poses>, M: Mac>(
    surface: &'static dibs_surface,
    tree: &'static dibs_tree,
    limits: dibs_guard_limits,
    mac: M,
) -> Result<OfRows<R, M>, dibs_code> {
    let limits = limits.read()?;
    surface.check_guarded(tree.rows())?;
    let of_tree = (&tree.tree, TreeBytes::new(tree.bytes), &R::of(&tree.tree)?);
    surface.with_writer(|writer| Ok(Bus::new(&surface.notes, writer, of_tree, &limits, mac)?))
}

/// Receives bytes from a serial line or another stream. `dibs_bus_counters` counts the outcomes by cause.
///
/// Cost: linear in the bytes. `dibs_bus_work` must keep up: a complete frame is dropped if the next one begins before
/// it was checked.
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

/// Receives one packet, from a bus that preserves packet boundaries.
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
        Out::set_if_any(progress, outcome.into());
        Ok(())
    })
}

/// Does a slice of the checks: checks some rows and triangles of the arriving frame, and publishes it once it is
/// complete and admitted. Without a frame it checks the tree's bytes.
///
/// Cost: linear in `work`.
///
/// @param bus      The bus.
/// @param work     Most rows and triangles that are checked.
/// @param advance  Receives the outcome, `DIBS_ADVANCE_PENDING` if more work is due at once; or null.
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
        Out::set_if_any(advance, outcome.into());
        Ok(())
    })
}

/// Writes the status for the sender, if one is due. The sender's next frame echoes it, which measures the transit time
/// of frames. Call it after each slice of work: a status is due if there is news, or 100 ms have passed.
///
/// @param bus       The bus.
/// @param now       The receiver's clock, in ms.
/// @param framed    0 for a packet; otherwise a COBS frame with the zero that ends it, for a stream.
/// @param out       Receives the status.
/// @param capacity  Size of `out` in bytes: at least `DIBS_STATUS`.
/// @param length    Receives the status's length; 0 if none is due.
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
        // Checked before the status is made: a status that does not fit would be lost.
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

/// State of a bus.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_bus_facts {
    /// 0 before the first frame; the epoch is then 0 as well.
    pub is_published: u32,
    /// Number of the latest published frame; wraps.
    pub epoch: u32,
    /// Completed rounds of the check of the tree's bytes; wraps.
    pub rounds: u32,
}

/// Reads the state of a bus.
///
/// @param bus    The bus.
/// @param facts  Receives the state.
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

/// Position (mm) of a vertex, or node, in the latest published frame, for a checksum of the published rows, or a log.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, `DIBS_CODE_ARGUMENT` beyond the last vertex,
///         or a misuse.
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

/// Registers the surface again, as `dibs_receiver_register` does: only an operator may decide this.
///
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_bus_register(bus: *mut dibs_bus) -> dibs_code {
    dibs_code::of(|| {
        with_bus!(&mut bus.open()?.0, |bus| bus.register());
        Ok(())
    })
}

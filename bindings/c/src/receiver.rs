//! The bus's end of a surface: from packets to published frames.

use core::ffi::{c_char, c_void};

use bytemuck::AnyBitPattern;
use dibs_nostd::wire::{
    AesCmac, Deframer, Event, Mac, NoMac, encode_status, enframe, framed_bytes,
};
use dibs_nostd::{
    Advance, Assembler, Millis, Progress, StretchMonitor, SurfaceLimits, VertexTable,
};

use crate::border::{Handle, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::outcome::{dibs_advance, dibs_progress};
use crate::surface::dibs_surface;
use crate::tags::dibs_tags;
use crate::tool::dibs_vec3;
use crate::tree::{Row, dibs_tree};

/// Bytes of a receiver's storage.
pub const DIBS_RECEIVER_SIZE: usize = 3_072;

/// Largest packet of a byte stream: that of an Ethernet frame.
pub const DIBS_MTU: usize = 1_472;

/// Largest status, framed or not.
pub const DIBS_STATUS: usize = 98;

/// Largest status packet: the report and all counters take three of them.
const STATUS: usize = 96;

const _: () = assert!(DIBS_STATUS == framed_bytes(STATUS));

/// Assembles frames from packets, checks them, and publishes those that are complete and valid.
///
/// One context at a time, of lower priority than the reader's: the bus interrupt.
pub struct dibs_receiver {
    assembler: TheAssembler,
    deframer: Deframer<DIBS_MTU>,
    surface: &'static dibs_surface,
    mesh_id: u32,
    /// Number of the latest published frame.
    published: Option<u32>,
}

type OfPackets<M> = Assembler<'static, StretchMonitor<'static, Row>, M>;

/// Of packets without tags, or with them.
enum TheAssembler {
    Untagged(OfPackets<NoMac>),
    Tagged(OfPackets<&'static AesCmac>),
}

/// Calls a function of the assembler, of either kind.
macro_rules! with_assembler {
    ($assembler:expr, |$own:ident| $call:expr) => {
        match $assembler {
            TheAssembler::Untagged($own) => $call,
            TheAssembler::Tagged($own) => $call,
        }
    };
}

impl TheAssembler {
    fn accept(&mut self, packet: &[u8], now: Millis) -> Result<Progress, dibs_code> {
        with_assembler!(self, |own| own.accept(packet, now)).map_err(dibs_code::from)
    }
}

impl Kind for dibs_receiver {
    const MARK: u32 = 0x6462_720E;
    const SIZE: usize = DIBS_RECEIVER_SIZE;
}

impl dibs_receiver {
    /// Passes the bus's health to the reader.
    fn note(&self) {
        let health = with_assembler!(&self.assembler, |own| own.health());
        self.surface.notes.link().set(&health);
    }

    /// The common end of all calls that receive a packet.
    fn end(
        &self,
        outcome: Result<Progress, dibs_code>,
        progress: Option<Out<dibs_progress>>,
    ) -> Result<(), dibs_code> {
        self.note();
        Out::set_if_any(progress, outcome?.into());
        Ok(())
    }
}

/// Limits of a surface in addition to the tree's stretch limit. A limit that is NaN refuses every frame.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_surface_limits {
    /// Largest magnitude (mm) of a coordinate. The smaller it is, the more damage it detects.
    pub reach: f32,
    /// Largest speed of a vertex, in mm per ms (m/s); `INFINITY` for no limit.
    pub speed: f32,
    /// Least size of a region relative to its size at rest, 0.25 for example; 0 for no limit.
    pub shrinkage: f32,
    /// Largest displacement (mm) of a vertex from its position in the published frame, however long ago that was; 0 for
    /// a tenth of the reach, `INFINITY` for no limit.
    pub recovery: f32,
}

impl From<dibs_surface_limits> for SurfaceLimits {
    fn from(given: dibs_surface_limits) -> Self {
        let limits = Self::reach_mm(given.reach).speed(given.speed).shrinkage(given.shrinkage);
        if given.recovery == 0.0 { limits } else { limits.recovery_mm(given.recovery) }
    }
}

/// Makes the receiver of a surface, once.
///
/// @param storage   `DIBS_RECEIVER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size      Bytes of the storage.
/// @param surface   The surface.
/// @param tree      Its tree.
/// @param limits    Limits of every frame.
/// @param receiver  Receives the receiver's address.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of vertices is not the tree's;
///         `DIBS_CODE_TAKEN` if the surface has a receiver already; `DIBS_CODE_TREE_NO_METRIC`; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_init(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_surface_limits,
    receiver: *mut *mut dibs_receiver,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, receiver, || {
            receiver_of(surface, tree, limits, NoMac, TheAssembler::Untagged)
        })
    })
}

/// The same, for a sender with a key: a packet without a genuine tag is refused and counted.
///
/// @param storage   As for `dibs_receiver_init`.
/// @param size      Bytes of the storage.
/// @param surface   The surface.
/// @param tree      Its tree.
/// @param limits    Limits of every frame.
/// @param tags      The tags.
/// @param receiver  Receives the receiver's address.
/// @return As `dibs_receiver_init`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_init_with_tags(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_surface_limits,
    tags: *mut dibs_tags,
    receiver: *mut *mut dibs_receiver,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, receiver, || {
            let tags = tags.share()?.mac();
            receiver_of(surface, tree, limits, tags, TheAssembler::Tagged)
        })
    })
}

fn receiver_of<M: Mac>(
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_surface_limits,
    mac: M,
    assembler: fn(OfPackets<M>) -> TheAssembler,
) -> Result<dibs_receiver, dibs_code> {
    let (surface, tree, given) = (surface.share()?, &tree.share()?.tree, limits.get()?);
    if surface.vertices() != tree.vertex_count() as usize {
        return Err(dibs_code::OtherTree);
    }
    let monitor = StretchMonitor::new(tree)?.limits(given.into());
    let (writer, mesh_id) = (surface.take_writer()?, tree.mesh_id());
    let assembler = assembler(Assembler::with_mac(writer, monitor, mesh_id, given.reach, mac));
    Ok(dibs_receiver { assembler, deframer: Deframer::new(), surface, mesh_id, published: None })
}

/// Registers the surface again: the next whole frame is not compared with an earlier one. For an operator who knows
/// that the tissue was moved farther than `dibs_surface_limits.recovery`; until then no frame that far away is
/// published.
///
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_register(receiver: *mut dibs_receiver) -> dibs_code {
    dibs_code::of(|| {
        with_assembler!(&mut receiver.open()?.assembler, |own| own.register());
        Ok(())
    })
}

/// Receives one whole packet: a datagram, or the data of a CAN-FD message.
///
/// Cost: linear in the bytes.
///
/// @param receiver  The receiver.
/// @param packet    The packet, read during the call.
/// @param length    Its bytes.
/// @param now       The receiver's clock, in ms; wraps.
/// @param progress  Receives its outcome, or null.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_PACKET_DAMAGED` to `DIBS_CODE_PACKET_REFUSED` if the packet was refused (and
///         counted), or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_accept(
    receiver: *mut dibs_receiver,
    packet: *const u8,
    length: usize,
    now: u32,
    progress: *mut dibs_progress,
) -> dibs_code {
    dibs_code::of(|| {
        let (progress, mut receiver) = (progress.check_if_any()?, receiver.open()?);
        let outcome = receiver.assembler.accept(packet.slice(length)?, Millis(now));
        receiver.end(outcome, progress)
    })
}

/// Receives one byte of a stream of COBS frames, each ended by a zero, such as a serial line.
///
/// @param receiver  The receiver.
/// @param byte      The byte.
/// @param now       The receiver's clock, in ms; wraps.
/// @param progress  Receives the outcome of the packet that the byte completes, or `DIBS_PROGRESS_NONE`; or null.
/// @return As `dibs_receiver_accept`; `DIBS_CODE_FRAMING` if the bytes between two zeros are not a packet.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_byte(
    receiver: *mut dibs_receiver,
    byte: u8,
    now: u32,
    progress: *mut dibs_progress,
) -> dibs_code {
    dibs_code::of(|| {
        let (progress, mut receiver) = (progress.check_if_any()?, receiver.open()?);
        let dibs_receiver { assembler, deframer, .. } = &mut *receiver;
        let outcome = match deframer.push(byte) {
            None => {
                Out::set_if_any(progress, dibs_progress::None);
                return Ok(());
            }
            Some(Ok(packet)) => assembler.accept(packet, Millis(now)),
            Some(Err(error)) => {
                with_assembler!(assembler, |own| own.count_framing(&error));
                Err(error.into())
            }
        };
        receiver.end(outcome, progress)
    })
}

/// Does some of the pending work: checks rows and triangles, and publishes a frame that is within its limits.
///
/// Call it after each packet, and from time to time when the bus is quiet. Cost: linear in `work`.
///
/// @param receiver  The receiver.
/// @param work      Most rows and triangles that are checked or copied.
/// @param advance   Receives the outcome, or null.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_STRETCH_EXCEEDED`, `DIBS_CODE_SHRUNK` or `DIBS_CODE_TOO_FAST` if the frame is
///         refused (and counted); or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_advance(
    receiver: *mut dibs_receiver,
    work: u32,
    advance: *mut dibs_advance,
) -> dibs_code {
    dibs_code::of(|| {
        let (advance, mut receiver) = (advance.check_if_any()?, receiver.open()?);
        let outcome = with_assembler!(&mut receiver.assembler, |own| own.advance(work));
        receiver.note();
        let outcome = outcome?;
        if let Advance::Published { epoch } = outcome {
            receiver.published = Some(epoch);
        }
        Out::set_if_any(advance, outcome.into());
        Ok(())
    })
}

/// Writes the receiver's status for the sender: every 100 ms or so, and as soon as a hello asks for it.
///
/// @param receiver  The receiver.
/// @param now       The receiver's clock, in ms.
/// @param safety    0 not reported, 1 nominal, 2 degraded, 3 safe.
/// @param framed    0 for a packet; otherwise a COBS frame with the zero that ends it, for a stream.
/// @param out       Receives the status.
/// @param capacity  Size of `out` in bytes: `DIBS_STATUS` is enough.
/// @param length    Receives the status's length.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_status(
    receiver: *mut dibs_receiver,
    now: u32,
    safety: u8,
    framed: u32,
    out: *mut u8,
    capacity: usize,
    length: *mut usize,
) -> dibs_code {
    dibs_code::of(|| {
        let (length, out) = (length.check()?, out.places(capacity)?);
        let mut receiver = receiver.open()?;
        let (mut packet, mut line) = ([0; STATUS], [0; DIBS_STATUS]);
        let mesh_id = receiver.mesh_id;
        let packet = with_assembler!(&mut receiver.assembler, |own| {
            let status = own.status(Millis(now), safety);
            encode_status(mesh_id, &status, own.counters(), own.mac(), &mut packet)
        });
        let bytes = if framed == 0 {
            packet
        } else {
            enframe(packet, &mut line).ok_or(dibs_code::Capacity)?
        };
        length.set(out.fill(bytes)?);
        Ok(())
    })
}

/// Number of the latest published frame; wraps.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_epoch(receiver: *mut dibs_receiver, epoch: *mut u32) -> dibs_code {
    dibs_code::of(|| {
        let (epoch, receiver) = (epoch.check()?, receiver.open()?);
        epoch.set(receiver.published.ok_or(dibs_code::NoSurface)?);
        Ok(())
    })
}

/// Position (mm) of a vertex in the latest published frame, for a checksum of the published rows, or a log.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` before the first frame, `DIBS_CODE_ARGUMENT` outside the table, or a
///         misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_position(
    receiver: *mut dibs_receiver,
    row: u32,
    position: *mut dibs_vec3,
) -> dibs_code {
    dibs_code::of(|| {
        let (position, receiver) = (position.check()?, receiver.open()?);
        let surface = with_assembler!(&receiver.assembler, |own| own.surface());
        let surface = surface.ok_or(dibs_code::NoSurface)?;
        position.set(surface.position(row).ok_or(dibs_code::Argument)?.into());
        Ok(())
    })
}

/// Events that a receiver counts.
pub const DIBS_EVENTS: usize = 27;

const _: () = assert!(Event::ALL.len() == DIBS_EVENTS);

/// Name of an event, in English: published, abandoned, duplicate, heartbeat, then rejections by their cause.
///
/// @param event  Its index among the counters.
/// @return A static text; never null, even for a number that is not an event.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_event_name(event: u32) -> *const c_char {
    let event = Event::ALL.into_iter().find(|known| *known as u32 == event);
    event.map_or(c"no event", Event::c_name).as_ptr()
}

/// The count of each event since the start, in the order of `dibs_event_name`.
///
/// @param receiver  The receiver.
/// @param counters  Room for `DIBS_EVENTS` numbers.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_receiver_counters(
    receiver: *mut dibs_receiver,
    counters: *mut u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (out, receiver) = (counters.places(DIBS_EVENTS)?, receiver.open()?);
        let all = with_assembler!(&receiver.assembler, |own| own.counters());
        out.fill(&Event::ALL.map(|event| all.of(event))).map(|_| ())
    })
}

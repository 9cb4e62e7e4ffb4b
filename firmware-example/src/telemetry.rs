//! The controller's records for the host: one a tick, and a summary at the end.
//!
//! A record is its fields in order, little-endian, 32 bits each, then a CRC-32 (ISO-HDLC) of them, framed with COBS and
//! a zero byte. The first field is the kind of record.

use bytemuck::{NoUninit, Pod, Zeroable};
use dibs_nostd::filter::{AdmittedMotion, FilterError, Reason};
use dibs_nostd::wire::{Event, enframe, framed_bytes};
use dibs_nostd::{Fallback, Unavailable};

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Bytes of a checksum.
const CHECKSUM: usize = 4;

/// Largest record, in bytes.
const LARGEST: usize =
    if size_of::<Tick>() > size_of::<Summary>() { size_of::<Tick>() } else { size_of::<Summary>() };

/// Largest record on the line, in bytes.
pub const MAX_FRAMED: usize = framed_bytes(LARGEST + CHECKSUM);

/// One control tick.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Tick {
    /// [`Tick::KIND`].
    pub kind: u32,
    /// Number of the tick, from 0.
    pub tick: u32,
    /// The trust in the surface: `dibs_nostd::failsafe::State` as a number.
    pub state: u32,
    /// Why the state is not nominal: [`cause_code`]; 0 if it is.
    pub cause: u32,
    /// 1 if there was an answer, else 0.
    pub answered: u32,
    /// Largest motion of the tissue, in mm: its speed times the surface's lag and its frame's transit time. It is part
    /// of the accuracy of the constraint's answer.
    pub margin: f32,
    /// The frame that was searched, if there was an answer.
    pub epoch: u32,
    /// Its age in ticks.
    pub age: u32,
    /// Largest distance of the surface's vertices from the sender's, in mm: the bus's quantisation.
    pub position_error: f32,
    /// The start of the instrument's axis, its tip, exactly as in the query, in mm.
    pub tool_start: [f32; 3],
    /// The end of its axis, in mm.
    pub tool_end: [f32; 3],
    /// Its radius, in mm.
    pub tool_radius: f32,
    /// The answer: see `dibs_nostd::Proximity`, in mm.
    pub separation: f32,
    /// Lower end of the certified interval, in mm.
    pub lower: f32,
    /// Stated accuracy of both, in mm: the position error plus the rounding of the query.
    pub accuracy: f32,
    /// The surface's point of the closest pair, in mm.
    pub point_on_surface: [f32; 3],
    /// The pair's position along the instrument's axis: 0 at its start, 1 at its end.
    pub axis_parameter: f32,
    /// The direction out of the tissue: `dibs_nostd::Proximity::direction`.
    pub direction: [f32; 3],
    /// The row of the pair's triangle in the tree; `u32::MAX` if there is none.
    pub triangle: u32,
    /// Tests of spheres and planes.
    pub node_tests: u32,
    /// Triangles tested.
    pub triangle_tests: u32,
    /// The force on the instrument, in N.
    pub force: [f32; 3],
    /// Clock counts of the guard's answer; 0 without a clock.
    pub query_counts: u32,
    /// Bytes received from the bus; wraps.
    pub bytes: u32,
    /// Ticks since the last good packet; `u32::MAX` before the first.
    pub silence: u32,
    /// Frames published so far.
    pub frames_published: u32,
    /// Packets and frames rejected so far.
    pub rejected: u32,
    /// Epoch of the frame that the background last read completely; 0 if there is none.
    pub read_epoch: u32,
    /// The CRC-32 of its positions: [`fingerprint`](crate::fingerprint).
    pub read_digest: u32,
    /// Nodes that the tracker had open after the tick.
    pub front: u32,
    /// Why the tick was a whole query: [`fallback_code`]; 0 if it was not.
    pub fallback: u32,
    /// The frame before the searched one, from which the surface was extrapolated; the same frame if it was held.
    pub epoch_before: u32,
    /// The surface's time in frame intervals: `dibs_nostd::SurfaceBlend::t`.
    pub blend: f32,
    /// The error of recent extrapolations, in mm: `dibs_nostd::SurfaceBlend::residual`; -1 if unknown.
    pub residual: f32,
    /// The surface's velocity at the pair, in mm/s.
    pub surface_velocity: [f32; 3],
    /// Number of contacts listed; 0 in a tick with a command, which lists none.
    pub contacts: u32,
    /// All contacts with a separation below this, in mm, are listed: `dibs_nostd::Contacts::bound`.
    pub contacts_bound: f32,
}

/// A fallback as a number.
#[must_use]
pub const fn fallback_code(fallback: Option<Fallback>) -> u32 {
    match fallback {
        None => 0,
        Some(Fallback::Start) => 1,
        Some(Fallback::Surface) => 2,
        Some(Fallback::Jump) => 3,
        Some(Fallback::Full) => 4,
        Some(_) => 5,
    }
}

/// Of a cause that has no number yet.
const OTHER_CAUSE: u32 = u32::MAX;

/// A cause as a number.
#[must_use]
pub const fn cause_code(cause: &Unavailable) -> u32 {
    match cause {
        Unavailable::NoSurface => 1,
        Unavailable::Stale { .. } => 2,
        Unavailable::Query(_) => 3,
        Unavailable::LinkLost { .. } => 4,
        Unavailable::HeartbeatLost { .. } => 5,
        Unavailable::Rejections { .. } => 6,
        Unavailable::CorruptTree => 7,
        Unavailable::Delayed { .. } => 9,
        Unavailable::SourceStale { .. } => 10,
        Unavailable::Forgeries { .. } => 11,
        Unavailable::CutShort => 12,
        Unavailable::Unacknowledged => 13,
        Unavailable::NotFinite => 8,
        Unavailable::NoPose => 14,
        Unavailable::NoDirection => 15,
        Unavailable::NoSide => 16,
        // A cause of a later version of the library.
        _ => OTHER_CAUSE,
    }
}

/// The name of a cause's number.
#[must_use]
pub const fn cause_name(code: u32) -> &'static str {
    match code {
        0 => "none",
        1 => "no surface",
        2 => "surface too old",
        3 => "query failed",
        4 => "link lost",
        5 => "heartbeat lost",
        6 => "rejections in a row",
        7 => "tree changed",
        9 => "delayed on its way",
        10 => "source stands still",
        11 => "forgeries",
        12 => "budget too small",
        8 => "number not finite",
        13 => "not acknowledged",
        14 => "no pose",
        15 => "no direction",
        16 => "side unknown",
        _ => "a cause without a name",
    }
}

impl Tick {
    /// First field of a tick's record.
    pub const KIND: u32 = 1;

    /// Whether the record holds an answer.
    #[must_use]
    pub fn is_answered(&self) -> bool {
        self.answered == 1
    }
}

/// The whole run.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Summary {
    /// [`Summary::KIND`].
    pub kind: u32,
    /// Control ticks run.
    pub ticks: u32,
    /// Ticks that ended later than the next one was due, and ticks that never ran.
    pub deadline_misses: u32,
    /// Longest time from a tick's due time to its first instruction, in clock counts.
    pub latency_counts: u32,
    /// Longest time from a tick's due time to its end, in clock counts.
    pub tick_counts: u32,
    /// Records that were dropped because the queue was full.
    pub records_dropped: u32,
    /// 1 if the bus ever lost a byte because it was not read in time, else 0.
    pub bus_overrun: u32,
    /// Largest stack use, in bytes.
    pub stack_bytes: u32,
    /// Longest section with all interrupts disabled, in clock counts.
    pub masked_counts: u32,
    /// Longest section with the bus interrupt disabled, without the control ticks during it, in clock counts.
    pub bus_masked_counts: u32,
    /// Completed rounds of the background check of the tree.
    pub scrub_rounds: u32,
    /// Counters of the bus, in the order of `dibs_nostd::wire::Event::ALL`.
    pub events: [u32; Event::ALL.len()],
}

impl Summary {
    /// First field of a summary.
    pub const KIND: u32 = 2;
}

/// The record of a hand that pushes, for one control tick; a scripted instrument has none.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Push {
    /// [`Push::KIND`].
    pub kind: u32,
    /// Number of the tick.
    pub tick: u32,
    /// 0 while the hand moves the instrument against the wall's force; with a filter its reason, as [`reason_code`].
    pub outcome: u32,
    /// 1 while the hand pushes inwards, 0 while it draws back.
    pub is_inwards: u32,
    /// The hand's push, in N.
    pub push: [f32; 3],
    /// The velocity of this push without resistance, in mm/s; with a filter the commanded velocity.
    pub commanded: [f32; 3],
    /// The instrument's velocity until the next tick, in mm/s; with a filter the admitted velocity.
    pub moved: [f32; 3],
    /// The instrument's velocity relative to the surface's until this tick, in mm/s.
    pub velocity: [f32; 3],
    /// With a filter: lower bound on the separation until the next tick, in mm.
    pub least_separation: f32,
    /// With a filter: the number of its queries.
    pub queries: u32,
    /// With a filter: instructions of these queries, by the cost model.
    pub instructions: u32,
    /// The energy that the wall may still give to the hand, in mJ.
    pub balance: f32,
}

impl Push {
    /// First field.
    pub const KIND: u32 = 4;

    /// Records a filter's answer.
    pub(crate) fn filtered(&mut self, admitted: &Result<AdmittedMotion, FilterError>) {
        self.outcome = reason_code(admitted.as_ref().ok().map(|admitted| admitted.reason));
        let (least, queries, instructions) = match admitted {
            Ok(admitted) => (admitted.least_separation, admitted.queries, admitted.instructions),
            Err(_) => (0.0, 0, 0),
        };
        (self.least_separation, self.queries, self.instructions) = (least, queries, instructions);
    }
}

/// A filter's reason as a number; for `None` it admitted nothing.
#[must_use]
pub const fn reason_code(reason: Option<Reason>) -> u32 {
    match reason {
        Some(Reason::Commanded) => 1,
        Some(Reason::Nearest) => 2,
        Some(Reason::Shortened) => 3,
        Some(Reason::Stopped) => 4,
        Some(Reason::Retreating) => 5,
        Some(Reason::NoSafeMotion) => 6,
        _ => 7,
    }
}

/// The record of the network for the whole run; a run over a serial line has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Network {
    /// [`Network::KIND`].
    pub kind: u32,
    /// Ethernet frames received.
    pub frames: u32,
    /// Frames with a packet for the controller's port.
    pub packets: u32,
    /// Good packets of its surface.
    pub good: u32,
    /// ARP requests for its hardware address, which were answered.
    pub questions: u32,
    /// Clock counts of the network's driver and of parsing frames, without the control ticks during them.
    pub driver_counts: u32,
    /// Clock counts of receiving the packets.
    pub packet_counts: u32,
}

impl Network {
    /// First field.
    pub const KIND: u32 = 3;
}

/// A decoded record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Record {
    /// One control tick.
    Tick(Tick),
    /// The hand during that tick.
    Push(Push),
    /// The network.
    Network(Network),
    /// The whole run: the last record.
    Summary(Summary),
}

/// Writes a record's fields to `out`, framed for the line; `None` only if `out` is too small.
pub fn frame<'b, T: NoUninit>(record: &T, out: &'b mut [u8; MAX_FRAMED]) -> Option<&'b [u8]> {
    const { assert!(cfg!(target_endian = "little"), "records are little-endian") };
    let mut bytes = [0; LARGEST + CHECKSUM];
    let fields = bytemuck::bytes_of(record);
    let (place, rest) = bytes.split_at_mut_checked(fields.len())?;
    for (to, from) in place.iter_mut().zip(fields) {
        *to = *from;
    }
    *rest.first_chunk_mut()? = CRC.checksum(fields).to_le_bytes();
    enframe(bytes.get(..fields.len() + CHECKSUM)?, out)
}

impl Record {
    /// Decodes a record of [`frame`], without its COBS framing; `None` if it is damaged.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (fields, stated) = bytes.split_last_chunk::<CHECKSUM>()?;
        if CRC.checksum(fields) != u32::from_le_bytes(*stated) {
            return None;
        }
        let kind = u32::from_le_bytes(*fields.first_chunk()?);
        match kind {
            Tick::KIND => bytemuck::try_pod_read_unaligned(fields).ok().map(Self::Tick),
            Push::KIND => bytemuck::try_pod_read_unaligned(fields).ok().map(Self::Push),
            Network::KIND => bytemuck::try_pod_read_unaligned(fields).ok().map(Self::Network),
            Summary::KIND => bytemuck::try_pod_read_unaligned(fields).ok().map(Self::Summary),
            _ => None,
        }
    }
}

//! From packets to published frames: the gate between the bus and what the controller acts on.

mod gate;
mod rejection;

use core::ops::Range;

use glam::Vec3;

use crate::MAX_COORDINATE;
use crate::frames::{FrameLabel, FrameView, FrameWriter, PublishError};
use crate::wire::{
    Begin, Body, Commit, Content, Encoding, Packet, Rows, Vertices, Weights, float_position,
    quantised_row,
};

pub use gate::{Changed, Gate, Unchecked, Verdict};
use rejection::increment;
pub use rejection::{Counters, Rejection};

/// Assembles frames of `N` vertices from packets, and publishes those that are complete and right.
///
/// A frame is published when every vertex has come, the commit's digest confirms that all packets
/// were of one frame, and the [`Gate`] admits the surface. Until then, and after any rejection, the
/// frame published last stays. Packets between begin and end may come in any order and repeatedly.
///
/// | what comes | what happens |
/// |---|---|
/// | begin, epoch newer than the frame in work | that frame is abandoned, a new one starts |
/// | begin, same epoch, other contents | the sender restarted: the frame starts again |
/// | any epoch not newer than the published one | [`Rejection::Stale`] |
/// | vertices or commit without their begin | [`Rejection::Unexpected`] |
/// | a packet that came before | [`Progress::Duplicate`], ignored |
/// | commit before the last vertices | it waits for them |
/// | digest or gate fails | the frame is abandoned |
///
/// Epochs are compared as serial numbers (RFC 1982): they wrap, and up to 2^31 ahead is newer.
///
/// Cost of [`accept`](Self::accept): O(1) a vertex in the packet, O(`N / 128`) at a begin, and the
/// gate's own cost at the end of a frame. No memory beyond the [`Frames`](crate::Frames).
///
/// ```
/// use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{Assembler, Frames, Progress, Unchecked, VertexTable, glam::Vec3};
///
/// static FRAMES: Frames<3> = Frames::new();
/// let (writer, mut reader) = FRAMES.split().unwrap();
/// let mut assembler = Assembler::new(writer, Unchecked, 0xB0D1, 1000.0);
///
/// let positions = [Vec3::X, Vec3::Y, Vec3::Z];
/// let mut sender = FrameEncoder::<_, 64>::new(
///     FrameId { mesh_id: 0xB0D1, session: 1, epoch: 1 },
///     Encoding::Float,
///     &positions[..],
/// )
/// .unwrap();
/// let mut buffer = [0; 64];
/// let mut last = None;
/// while let Some(packet) = sender.next_packet(&mut buffer) {
///     last = Some(assembler.accept(packet, 0).unwrap());
/// }
/// assert_eq!(last, Some(Progress::Published { epoch: 1 }));
/// assert_eq!(reader.read().unwrap().position(2), Some(Vec3::Z));
/// ```
pub struct Assembler<'f, G, const N: usize> {
    writer: FrameWriter<'f, N>,
    gate: G,
    mesh_id: u32,
    max_coordinate: f32,
    published: Option<u32>,
    frame: Option<Frame>,
    counters: Counters,
}

/// The frame in work.
#[derive(Clone, Copy)]
struct Frame {
    epoch: u32,
    received: u32,
    encoding: Encoding,
    /// Checksum of the begin packet: tells a repeated begin from a restarted sender's.
    begin: u32,
    /// Sum of the checksums so far.
    sum: u32,
    /// The digest that the commit stated, once it has come.
    digest: Option<u32>,
    /// Set once the gate has admitted the frame: only publication is left.
    admitted: Option<FrameLabel>,
}

/// What a packet led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Progress {
    /// A frame began.
    Begun {
        /// Its number.
        epoch: u32,
    },
    /// The packet was taken.
    Stored {
        /// Vertices still to come; at 0 the commit is.
        missing: u32,
    },
    /// The packet had come before, and was ignored.
    Duplicate,
    /// The frame is complete and admitted, but a read of the last one is in progress: the next
    /// [`accept`](Assembler::accept) or [`poll`](Assembler::poll) publishes it.
    Held {
        /// Its number.
        epoch: u32,
    },
    /// The frame is published.
    Published {
        /// Its number.
        epoch: u32,
    },
}

impl<'f, G: Gate, const N: usize> Assembler<'f, G, N> {
    /// An assembler for the mesh with this id, whose vertices keep within `max_coordinate` (mm) of
    /// the origin on each axis, at most [`MAX_COORDINATE`]. The smaller that is, the more damage it
    /// tells from a surface, and it bounds the accuracy of every query. If it is not a number, nothing
    /// is ever published.
    #[must_use]
    pub fn new(writer: FrameWriter<'f, N>, gate: G, mesh_id: u32, max_coordinate: f32) -> Self {
        let max_coordinate =
            if max_coordinate > MAX_COORDINATE { MAX_COORDINATE } else { max_coordinate };
        Self {
            writer,
            gate,
            mesh_id,
            max_coordinate,
            published: None,
            frame: None,
            counters: Counters::default(),
        }
    }

    /// Takes one packet, whole. `now` is the receiver's clock (any unit; wraps): the frame's label
    /// keeps its value at the begin packet, because the surface is at least that old.
    ///
    /// # Errors
    /// [`Rejection`] says why the packet or its frame was not taken; it has been counted.
    pub fn accept(&mut self, packet: &[u8], now: u32) -> Result<Progress, Rejection> {
        self.poll();
        let outcome = self.take(packet, now);
        match &outcome {
            Ok(Progress::Duplicate) => increment(&mut self.counters.duplicates),
            Ok(_) => (),
            Err(rejection) => self.counters.count(rejection),
        }
        outcome
    }

    /// Publishes a frame that was held because a read was in progress; the epoch if that succeeded.
    /// Never needed on one core where the reader preempts the writer.
    pub fn poll(&mut self) -> Option<u32> {
        let frame = self.frame?;
        match self.publish(frame.epoch, frame.admitted?) {
            Ok(Progress::Published { epoch }) => Some(epoch),
            _ => None,
        }
    }

    /// Number of the frame published last.
    #[must_use]
    pub const fn published_epoch(&self) -> Option<u32> {
        self.published
    }

    /// What has happened since start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The frame published last.
    #[must_use]
    pub fn surface(&self) -> Option<FrameView<'_, N>> {
        self.writer.front()
    }

    fn take(&mut self, packet: &[u8], now: u32) -> Result<Progress, Rejection> {
        let packet = Packet::decode(packet)?;
        if packet.mesh_id != self.mesh_id {
            return Err(Rejection::WrongMesh { mesh_id: packet.mesh_id });
        }
        let epoch = packet.epoch;
        if self.published.is_some_and(|published| !is_newer(epoch, published)) {
            return Err(Rejection::Stale { epoch });
        }
        match (packet.body, self.frame) {
            (Body::Begin(begin), frame) => self.begin(&packet, begin, frame, now),
            (Body::Vertices(vertices), Some(frame)) if frame.epoch == epoch => {
                self.vertices(frame, packet.checksum, vertices)
            }
            (Body::Weights(weights), Some(frame)) if frame.epoch == epoch => {
                self.weights(frame, packet.checksum, weights)
            }
            (Body::Commit(commit), Some(frame)) if frame.epoch == epoch => {
                self.commit(frame, commit)
            }
            _ => Err(Rejection::Unexpected { epoch }),
        }
    }

    fn begin(
        &mut self,
        packet: &Packet<'_>,
        begin: Begin,
        frame: Option<Frame>,
        now: u32,
    ) -> Result<Progress, Rejection> {
        let epoch = packet.epoch;
        if begin.rows as usize != N {
            return Err(Rejection::VertexCount { vertices: begin.rows });
        }
        match begin.content {
            Content::Whole if self.gate.weight_range(0).is_none() => (),
            Content::Modal if self.gate.weight_range(0).is_some() => (),
            _ => return Err(Rejection::OtherEncoding),
        }
        // A box within the limit holds no row beyond it: quantised vertices need no further check.
        if let Encoding::Quantised(grid) = begin.encoding {
            for corner in [grid.origin(), grid.upper_corner()] {
                self.check(corner.to_array(), 0)?;
            }
        }
        if let Some(frame) = frame {
            if frame.epoch == epoch && frame.begin == packet.checksum {
                return Ok(Progress::Duplicate);
            }
            if frame.epoch != epoch && !is_newer(epoch, frame.epoch) {
                return Err(Rejection::Stale { epoch });
            }
            increment(&mut self.counters.abandoned);
        }
        self.writer.begin();
        self.frame = Some(Frame {
            epoch,
            received: now,
            encoding: begin.encoding,
            begin: packet.checksum,
            sum: packet.checksum,
            digest: None,
            admitted: None,
        });
        Ok(Progress::Begun { epoch })
    }

    fn vertices(
        &mut self,
        mut frame: Frame,
        checksum: u32,
        vertices: Vertices<'_>,
    ) -> Result<Progress, Rejection> {
        let Vertices { first, rows } = vertices;
        let count = rows.len() as u32;
        let end = first.checked_add(count).filter(|&end| end as usize <= N);
        let range = first..end.ok_or(Rejection::OutOfRange { first, count })?;
        let is_repeated = self.is_repeated(range.clone(), first);
        // A write fails only outside the table, and the range is inside.
        match (rows, frame.encoding) {
            (Rows::Quantised(rows), Encoding::Quantised(grid)) => {
                if is_repeated? {
                    return Ok(Progress::Duplicate);
                }
                for (vertex, row) in range.zip(rows) {
                    let _ = self.writer.write(vertex, grid.position(quantised_row(row)));
                }
            }
            (Rows::Float(rows), Encoding::Float) if self.gate.weight_range(0).is_none() => {
                if is_repeated? {
                    return Ok(Progress::Duplicate);
                }
                for (vertex, row) in range.clone().zip(rows) {
                    self.check(float_position(row).to_array(), vertex)?;
                }
                for (vertex, row) in range.zip(rows) {
                    let _ = self.writer.write(vertex, float_position(row));
                }
            }
            _ => return Err(Rejection::OtherEncoding),
        }
        frame.sum = frame.sum.wrapping_add(checksum);
        self.frame = Some(frame);
        self.finish(frame)
    }

    fn weights(
        &mut self,
        mut frame: Frame,
        checksum: u32,
        weights: Weights<'_>,
    ) -> Result<Progress, Rejection> {
        let Weights { first, values } = weights;
        let count = values.len() as u32;
        let end = first.checked_add(count).filter(|&end| end as usize <= N);
        let range = first..end.ok_or(Rejection::OutOfRange { first, count })?;
        if self.is_repeated(range.clone(), first)? {
            return Ok(Progress::Duplicate);
        }
        for (mode, value) in range.clone().zip(values) {
            let weight = f32::from_le_bytes(*value);
            match self.gate.weight_range(mode) {
                Some([low, high]) if weight >= low && weight <= high => (),
                Some(_) if weight.is_finite() => return Err(Rejection::TooFar { vertex: mode }),
                Some(_) => return Err(Rejection::NotFinite { vertex: mode }),
                None => return Err(Rejection::OtherEncoding),
            }
        }
        for (mode, value) in range.zip(values) {
            let _ = self.writer.write(mode, Vec3::new(f32::from_le_bytes(*value), 0.0, 0.0));
        }
        frame.sum = frame.sum.wrapping_add(checksum);
        self.frame = Some(frame);
        self.finish(frame)
    }

    /// Whether all of these vertices came before; an error if only some did.
    fn is_repeated(&self, range: Range<u32>, first: u32) -> Result<bool, Rejection> {
        let count = range.len();
        match range.filter(|&vertex| self.writer.is_written(vertex)).count() {
            0 => Ok(false),
            written if written == count => Ok(true),
            _ => Err(Rejection::Overlap { first }),
        }
    }

    fn commit(&mut self, mut frame: Frame, commit: Commit) -> Result<Progress, Rejection> {
        if frame.digest == Some(commit.digest) {
            return Ok(Progress::Duplicate);
        }
        frame.digest = Some(commit.digest);
        self.frame = Some(frame);
        self.finish(frame)
    }

    /// Publishes the frame if nothing is missing any more.
    fn finish(&mut self, mut frame: Frame) -> Result<Progress, Rejection> {
        let missing = self.writer.missing();
        let (Some(stated), 0) = (frame.digest, missing) else {
            return Ok(Progress::Stored { missing });
        };
        // From here on the frame is published, held, or gone.
        self.frame = None;
        let computed = frame.sum;
        if stated != computed {
            return Err(Rejection::Digest { stated, computed });
        }
        self.gate.begin(Changed::Whole);
        let verdict = self.gate.advance(&self.writer.back(), N as u32, u32::MAX);
        let Verdict::Admitted(stretch) = verdict.map_err(Rejection::Stretch)? else {
            return Ok(Progress::Stored { missing });
        };
        let position_error = frame.encoding.error() + self.gate.position_error();
        let label =
            FrameLabel { epoch: frame.epoch, received: frame.received, position_error, stretch };
        frame.admitted = Some(label);
        self.frame = Some(frame);
        self.publish(frame.epoch, label)
    }

    fn publish(&mut self, epoch: u32, label: FrameLabel) -> Result<Progress, Rejection> {
        match self.writer.publish(label) {
            Ok(()) => {
                self.frame = None;
                self.published = Some(epoch);
                increment(&mut self.counters.published);
                Ok(Progress::Published { epoch })
            }
            Err(PublishError::Busy) => Ok(Progress::Held { epoch }),
            Err(PublishError::Incomplete { missing }) => Ok(Progress::Stored { missing }),
        }
    }

    /// An error unless every coordinate is finite and within the limit.
    fn check(&self, position: [f32; 3], vertex: u32) -> Result<(), Rejection> {
        // Not a number compares false, so one comparison an axis is all it takes.
        if position.iter().all(|coordinate| coordinate.abs() <= self.max_coordinate) {
            return Ok(());
        }
        if position.iter().all(|coordinate| coordinate.is_finite()) {
            Err(Rejection::TooFar { vertex })
        } else {
            Err(Rejection::NotFinite { vertex })
        }
    }
}

/// Serial number order: whether `a` comes after `b`, up to 2^31 ahead.
const fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b) as i32 > 0
}

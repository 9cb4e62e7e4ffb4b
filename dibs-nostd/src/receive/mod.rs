//! From packets to published frames: the admission check between the bus and the surface that the controller acts on.
//!
//! One file, because it is the assembler's whole interface.

// Requirement: B-11

mod arrivals;
mod collector;
mod error;
mod health;
mod local;
mod packets;
mod step;

use crate::MAX_COORDINATE;
use crate::math::order::smaller;
use crate::stretch::{
    Admission, AdmissionCheck, IncomingSurface, StretchError, StretchMonitor, SurfaceLimits,
};
use crate::surface::{
    FrameLabel, FrameView, FrameWriter, LastStep, Millis, PredictionCheck, PublishError,
};
use crate::tree::{Index, SurfaceFacts, Tree};
use crate::wire::{
    Body, Content, Counters, Event, FrameId, Mac, NoMac, Packet, Status, StreamError,
};

use collector::Collector;
pub use collector::LastHeartbeat;
pub use error::ReceiveError;
pub use health::BusHealth;
use health::FrameName;
use step::{Earlier, StepMeter};

/// Assembles frames of vertices from packets, and publishes those that are complete and admitted.
///
/// [`accept`](Self::accept) takes packets, in the bus interrupt. [`advance`](Self::advance) does the longer work, in
/// slices: it checks the surface ([`AdmissionCheck`]), publishes it, and copies the rows on which partial frames
/// build. The two must not interrupt each other: call both in the bus interrupt, or call `advance` at another priority
/// below the control tick's with the bus interrupt masked.
///
/// A frame is published when every row has arrived at its place in the sequence, the commit's digest confirms that all
/// packets belong to one frame, and the admission check admits the surface. Until then, and after any rejection, the
/// last published frame stays. `docs/wire.md` has the whole table of packets and outcomes. With a [`Mac`], a packet
/// without a genuine tag is dropped first.
///
/// With an admission check of modes the buffers have one row for each mode, and frames hold weights instead of
/// positions: see [`AdmissionCheck::weight_range`].
///
/// RAM: less than 700 bytes besides [`Frames`](crate::Frames) and admission check, for any number of vertices. A
/// surface's buffers with both ends, the assembler and the [`StretchMonitor`](crate::StretchMonitor) together take 24
/// bytes for each vertex plus at most 1,750 bytes.
///
/// ```
/// use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{
///     Advance, Assembler, BusHealth, FrameView, Frames, LastHeartbeat, Millis, NoAdmissionCheck, VertexTable,
///     glam::Vec3,
/// };
///
/// static FRAMES: Frames<3> = Frames::new();
/// let (writer, mut reader) = FRAMES.split().unwrap();
/// let mut assembler = Assembler::new(writer, NoAdmissionCheck, 0xB0D1, 1000.0);
///
/// let positions = [Vec3::X, Vec3::Y, Vec3::Z];
/// let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch: 1 };
/// let mut sender = FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..]).unwrap();
/// let mut buffer = [0; 64];
/// while let Some(packet) = sender.next_packet(&mut buffer) {
///     assembler.accept(packet, Millis(0)).unwrap();
/// }
/// assert_eq!(assembler.advance(100), Ok(Advance::Published { epoch: 1 }));
/// assert_eq!(reader.read().unwrap().position(2), Some(Vec3::Z));
///
/// // In the bus interrupt: the published surface, the health of the bus, the last heartbeat.
/// let published: FrameView<'_> = assembler.surface().unwrap();
/// assert_eq!(published.position(0), Some(Vec3::X));
/// let BusHealth { packet, rejections, .. } = assembler.health();
/// assert_eq!((packet, rejections), (Some(Millis(0)), 0));
/// assert_eq!(assembler.last_heartbeat(), None::<LastHeartbeat>);
/// ```
#[derive(Debug)]
pub struct Assembler<'f, G, M = NoMac> {
    writer: FrameWriter<'f>,
    admission_check: G,
    mac: M,
    max_coordinate: f32,
    collector: Collector,
    /// The current frame is admitted and labelled: only its publication is left.
    is_admitted: bool,
    /// Leading rows of the back buffer that equal the published ones, except those changed by the current partial
    /// frame.
    copied: u32,
    step: StepMeter,
    /// Rows were stored since copying began. If their frame is not published, copying starts again.
    is_dirty: bool,
    /// A partial frame was received, so each published frame is copied for the next one.
    takes_partial: bool,
    /// The quantisation box of the current frame is within the limit.
    is_box_inside: bool,
}

/// The outcome of a packet.
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
    Stored,
    /// The packet had arrived before, and was ignored.
    Duplicate,
    /// The frame is complete: [`Assembler::advance`] checks and publishes it.
    Complete {
        /// Its number.
        epoch: u32,
    },
    /// A heartbeat: [`Assembler::last_heartbeat`].
    Heartbeat,
    /// The sender asks for a status: send one now.
    Hello,
}

/// The outcome of a slice of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Advance {
    /// No complete frame is waiting; rows may be left to copy or to check in advance.
    Idle,
    /// More work is left.
    Pending,
    /// The frame is admitted, but a read of the last one is in progress: a later call publishes it. Never occurs on one
    /// core where the reader preempts the writer.
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

impl<'f, G: AdmissionCheck> Assembler<'f, G> {
    /// An assembler for the mesh with this id, whose vertices stay within `max_coordinate` (mm) of the origin on each
    /// axis, at most [`MAX_COORDINATE`]. A smaller limit detects more damage, and improves the accuracy of every query.
    /// With NaN nothing is ever published.
    #[must_use]
    pub fn new(
        writer: FrameWriter<'f>,
        admission_check: G,
        mesh_id: u32,
        max_coordinate: f32,
    ) -> Self {
        Assembler::with_mac(writer, admission_check, mesh_id, max_coordinate, NoMac)
    }
}

impl<'f, 't, I: Index> Assembler<'f, StretchMonitor<'t, I>> {
    /// An assembler for surfaces of this tree. It checks them in slices, and publishes those within the tree's stretch
    /// limit and these limits.
    ///
    /// # Errors
    /// [`StretchError::NoMetric`] if the tree was emitted without its metric section.
    pub fn for_tree(
        writer: FrameWriter<'f>,
        tree: &Tree<'t, I>,
        limits: SurfaceLimits,
    ) -> Result<Self, StretchError> {
        let monitor = StretchMonitor::new(tree)?.limits(limits);
        Ok(Self::new(writer, monitor, tree.mesh_id(), limits.reach))
    }
}

impl<'f, 't, I: Index> Assembler<'f, StretchMonitor<'t, I, 2>> {
    /// The same, for three buffers: the published frames can be interpolated between their times and extrapolated
    /// ([`FrameGuard::extrapolated`](crate::FrameGuard::extrapolated)). It measures twice as much.
    ///
    /// # Errors
    /// [`StretchError::NoMetric`] if the tree was emitted without its metric section.
    pub fn continuous(
        writer: FrameWriter<'f>,
        tree: &Tree<'t, I>,
        limits: SurfaceLimits,
    ) -> Result<Self, StretchError> {
        let monitor = StretchMonitor::continuous(tree)?.limits(limits);
        Ok(Self::new(writer, monitor, tree.mesh_id(), limits.reach))
    }
}

impl<'f, G: AdmissionCheck, M: Mac> Assembler<'f, G, M> {
    /// The same, for packets with tags.
    #[must_use]
    pub fn with_mac(
        writer: FrameWriter<'f>,
        admission_check: G,
        mesh_id: u32,
        max_coordinate: f32,
        mac: M,
    ) -> Self {
        let max_coordinate = smaller(max_coordinate, MAX_COORDINATE);
        Self {
            writer,
            admission_check,
            mac,
            max_coordinate,
            collector: Collector::new(mesh_id),
            is_admitted: false,
            step: StepMeter::new(),
            copied: 0,
            is_dirty: false,
            takes_partial: false,
            is_box_inside: false,
        }
    }

    /// Takes one whole packet. `now` is the receiver's clock. The frame's label stores its value at the begin packet,
    /// less the age that the frame had when it was sent.
    ///
    /// Cost: O(bytes).
    ///
    /// # Errors
    /// [`ReceiveError`] tells why the packet or its frame was rejected; the event has been counted.
    #[inline]
    pub fn accept(&mut self, packet: &[u8], now: Millis) -> Result<Progress, ReceiveError> {
        self.collector.set_now(now);
        // Borrowed: moved out of the result, each packet would be copied.
        let decoded = Packet::decode(packet);
        let packet = match &decoded {
            Ok(packet) => packet,
            Err(error) => {
                let rejection = ReceiveError::Packet(*error);
                self.collector.refuse_bytes(rejection.event());
                return Err(rejection);
            }
        };
        let outcome = self.take(packet);
        match &outcome {
            Ok(Progress::Duplicate) => self.collector.counters.count(Event::Duplicate),
            Ok(Progress::Hello) => (),
            Ok(progress) => {
                self.collector.note_packet();
                if *progress == Progress::Heartbeat {
                    self.collector.counters.count(Event::Heartbeat);
                }
            }
            Err(rejection) => {
                let is_begin = matches!(packet.body, Body::Begin(_));
                self.collector.refuse::<M>(FrameName::of_packet(packet), is_begin, rejection);
            }
        }
        outcome
    }

    /// Does a slice of work: compares rows with the published ones and checks triangles, or copies rows, at most `work`
    /// in all, and publishes an admitted frame.
    ///
    /// Call it after each packet, so that the check keeps up with the frame, and periodically while the bus is quiet.
    /// Cost: O(`work`), with a sliced admission check.
    ///
    /// # Errors
    /// [`ReceiveError::Stretch`] if the admission check refuses the surface; it has been counted.
    pub fn advance(&mut self, work: u32) -> Result<Advance, ReceiveError> {
        let Some(frame) = &self.collector.frame else {
            self.clean();
            let has_base = self.takes_partial && self.collector.published_id().is_some();
            if has_base && self.copied < self.writer.len() {
                self.copy(work);
            }
            return Ok(Advance::Idle);
        };
        if self.is_admitted {
            return Ok(self.publish());
        }
        let ready = match frame.begin.content {
            Content::Partial { .. } => {
                let (is_complete, ready) = (frame.is_complete, frame.arrivals.ready());
                if self.copied < self.writer.len() {
                    self.copy(work);
                    return Ok(if is_complete { Advance::Pending } else { Advance::Idle });
                }
                if is_complete { self.writer.len() } else { ready }
            }
            _ => frame.arrivals.ready(),
        };
        self.check(ready, work)
    }

    /// The receiver's status for the sender, or its answer to a hello: [`encode_status`](crate::wire::encode_status)
    /// makes a packet of it. Make one as soon as a hello has arrived. `safety` as in [`Status::safety`].
    pub fn status(&mut self, now: Millis, safety: u8) -> Status {
        let stretch = self.writer.front().and_then(|front| front.label().stretch);
        let stretch = stretch.map(|stretch| stretch.sigma());
        let surface = self.surface_facts();
        self.collector.status(now, safety, stretch, self.mac.challenge(), surface)
    }

    /// The facts of this receiver's surface, for comparison with the sender's.
    fn surface_facts(&self) -> SurfaceFacts {
        let facts = self.admission_check.surface_facts();
        let is_modal = self.admission_check.weight_range(0).is_some();
        if is_modal { facts } else { SurfaceFacts { vertices: self.writer.len(), ..facts } }
    }

    /// The id of the mesh whose frames are accepted.
    #[cfg(feature = "control")]
    pub(crate) const fn mesh_id(&self) -> u32 {
        self.collector.mesh_id()
    }

    /// The checksum of the tree whose frames are accepted, if the admission check has one.
    #[cfg(all(feature = "control", feature = "modes"))]
    pub(crate) fn tree_checksum(&self) -> Option<u32> {
        self.admission_check.motion_unit().map(|unit| unit.tree)
    }

    /// Name of the last published frame.
    #[must_use]
    pub fn published(&self) -> Option<FrameId> {
        self.collector.published_id()
    }

    /// The sender's last sign of life.
    #[must_use]
    pub const fn last_heartbeat(&self) -> Option<LastHeartbeat> {
        self.collector.last_heartbeat()
    }

    /// The events since the start.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.collector.counters
    }

    /// Counts bytes of a stream that were not a packet, as reported by a [`Deframer`](crate::wire::Deframer).
    pub fn count_framing(&mut self, _: &StreamError) {
        self.collector.refuse_bytes(Event::Framing);
    }

    /// The health of the bus, for a fail-safe machine. O(1).
    #[must_use]
    pub fn health(&self) -> BusHealth {
        self.collector.health()
    }

    /// The last published frame.
    #[must_use]
    pub fn surface(&self) -> Option<FrameView<'_>> {
        self.writer.front()
    }

    /// Registers the surface anew: like the first frame, the next whole frame is not compared with an earlier one. For
    /// an operator who knows that the tissue was moved, for example with the patient, beyond the limit on
    /// [recovery](SurfaceLimits::recovery_mm). Until then no frame that far away is published.
    pub const fn register(&mut self) {
        self.collector.register();
    }

    /// The admission check.
    #[must_use]
    pub const fn admission_check(&self) -> &G {
        &self.admission_check
    }

    /// The authenticator.
    #[must_use]
    pub const fn mac(&self) -> &M {
        &self.mac
    }

    /// Discards the copied rows if rows of an unpublished frame have overwritten them.
    fn clean(&mut self) {
        if self.is_dirty {
            self.is_dirty = false;
            self.copied = 0;
        }
    }

    /// Copies rows from the published buffer to the back buffer.
    fn copy(&mut self, work: u32) {
        let end = self.copied.saturating_add(work);
        let end = if end < self.writer.len() { end } else { self.writer.len() };
        self.writer.copy(self.copied..end);
        self.copied = end;
    }

    /// Lets the admission check check a slice of the current frame.
    fn check(&mut self, ready: u32, work: u32) -> Result<Advance, ReceiveError> {
        let Some(frame) = &self.collector.frame else { return Ok(Advance::Idle) };
        let (back, front) = (self.writer.back(), self.writer.front());
        let unit = self.admission_check.motion_unit();
        let (mut work, mut compared) = (work, None);
        if let (Some(front), Some(_)) = (&front, &unit) {
            let two = self.writer.last_two();
            let age = front.time_to(frame.captured());
            let earlier = two.as_ref().and_then(|[before, last]| {
                let step = LastStep::between(before, last)?;
                Some(Earlier { frame: before, units: step.units(), t: step.ahead(age) })
            });
            work = self.step.compare(
                &self.admission_check,
                (&back, front),
                earlier.as_ref(),
                ready,
                work,
            );
            if frame.is_complete && self.step.rows() < ready {
                return Ok(Advance::Pending);
            }
            compared = Some(self.step.compared());
        }
        // A registration is not compared with an earlier frame. A partial frame is no registration: its other rows are
        // the published one's.
        let is_registration = self.collector.is_registration && !frame.is_partial();
        let before = front.as_ref().filter(|_| !is_registration);
        let time = |front: &FrameView<'_>| {
            let time = self.collector.time_to(frame);
            time.unwrap_or_else(|| front.time_to(frame.captured()))
        };
        let before = before.map(|front| (front, time(front)));
        let verdict = self
            .admission_check
            .advance(IncomingSurface { surface: &back, ready, before, compared }, work);
        match verdict {
            Err(error) => {
                let rejection = ReceiveError::Stretch(error);
                let name = FrameName::of(&frame.id);
                self.collector.frame = None;
                self.collector.refuse::<M>(name, false, &rejection);
                Err(rejection)
            }
            Ok(_) if !frame.is_complete => Ok(Advance::Idle),
            Ok(Admission::Pending) => Ok(Advance::Pending),
            Ok(Admission::Admitted(stretch)) => {
                let error = frame.begin.encoding.error() + frame.error;
                let label = FrameLabel {
                    epoch: frame.id.epoch,
                    received: frame.captured(),
                    position_error: error + self.admission_check.position_error(),
                    stretch,
                };
                let before = front.and_then(|front| front.motion());
                let motion = unit.map(|unit| self.step.motion(&unit, before));
                let sigma = self.admission_check.ahead().unwrap_or(f32::NAN);
                let ahead = PredictionCheck { sigma, ..self.step.ahead(unit.as_ref()) };
                self.writer.set_label(label, motion, ahead);
                self.is_admitted = true;
                Ok(self.publish())
            }
        }
    }

    /// Publishes the current frame, once admitted.
    fn publish(&mut self) -> Advance {
        let Some(frame) = self.collector.frame else { return Advance::Idle };
        let epoch = frame.id.epoch;
        match self.writer.publish_complete() {
            Ok(()) => {
                self.is_admitted = false;
                self.copied = 0;
                self.is_dirty = false;
                self.collector.published(&frame);
                self.admission_check.published();
                Advance::Published { epoch }
            }
            Err(PublishError::Busy) => Advance::Held { epoch },
            Err(_) => Advance::Idle,
        }
    }
}

//! The bus's end: bytes in, published frames and statuses out.

// Requirements: B-01, B-11, M-02

use glam::{Quat, Vec3};

use super::surface::Notes;
use super::{GuardLimits, PosedRows, Rows, Vertices};
#[cfg(feature = "modes")]
use crate::modes::{MAX_MODES, ModalSurface, Modes, WeightsError};
use crate::surface::FrameView;
#[cfg(feature = "modes")]
use crate::surface::VertexTable;
use crate::tree::VertexOrder;
use crate::wire::{Counters, Deframer, Mac, NoMac, encode_status, enframe, framed_bytes};
use crate::{
    Advance, Assembler, Error, FrameWriter, Index, Millis, Progress, ReceiveError, RigidPose,
    Scrub, Tree, TreeBytes,
};

/// Largest packet on a byte stream; a network's packets may be larger.
const MTU: usize = 1_024;

/// Largest status, in bytes: it holds 13 counters, so three statuses hold all of them.
const STATUS: usize = 96;

/// Time between two statuses, unless a frame is published or refused earlier.
const INTERVAL: Millis = Millis(100);

/// Bytes of the tree checked in an idle slice for each unit of its work.
const SCRUBBED: u32 = 2;

type Receiver<'s, 't, I, M, R> = Assembler<'s, <R as Rows>::AdmissionCheck<'s, 't, I>, M>;

/// The bus's end of a [`Surface`](super::Surface): it takes packets, checks complete frames in slices, publishes them,
/// checks the tree's bytes, and makes the statuses for the sender.
///
/// Two contexts may use it, one at a time: an interrupt that receives bytes, and an idle loop that calls
/// [`work`](Self::work). Both have a lower priority than the control tick. RAM: less than 3 kB.
#[derive(Debug)]
pub struct Bus<'s, 't, I: Index, M: Mac = NoMac, R: Rows = Vertices> {
    notes: &'s Notes<R::Poses>,
    deframer: Deframer<MTU>,
    assembler: Receiver<'s, 't, I, M, R>,
    /// The mesh's vertex number of each row, to read a frame of this process.
    order: VertexOrder<'t, I>,
    scrub: Scrub<'t>,
    /// Time of the last status.
    reported: Millis,
    /// A frame was published or refused since then, or the sender asked for a status.
    has_news: bool,
}

impl<'s, 't, I: Index, M: Mac, R: Rows> Bus<'s, 't, I, M, R> {
    /// Bytes of a status on a byte stream before framing; enough on a network, too.
    pub const STATUS_BYTES: usize = STATUS;

    /// Bytes of the longest status on a byte stream.
    pub const STATUS_FRAMED: usize = framed_bytes(STATUS);

    /// The bus's end of buffers in the caller's memory.
    ///
    /// # Errors
    /// [`Error`]: the tree has no data to measure stretch, or a limit is out of range.
    #[doc(hidden)]
    #[inline(always)]
    pub fn new(
        notes: &'s Notes<R::Poses>,
        writer: FrameWriter<'s>,
        (tree, bytes, rows): (&Tree<'t, I>, TreeBytes<'t, I>, &R::Of<'t>),
        limits: &GuardLimits,
        mac: M,
    ) -> Result<Self, Error> {
        let limits = limits.surface::<I, R>(tree, rows)?;
        let admission_check = R::admission_check(tree, rows, limits, &notes.poses)?;
        Ok(Self {
            notes,
            deframer: Deframer::new(),
            assembler: Assembler::with_mac(
                writer,
                admission_check,
                tree.mesh_id(),
                limits.reach,
                mac,
            ),
            order: R::order(tree, rows),
            scrub: bytes.scrub(),
            reported: Millis(0),
            has_news: false,
        })
    }

    /// Takes bytes of a serial line or another stream, at the time `now`. The outcomes are counted by cause in
    /// [`counters`](Self::counters).
    ///
    /// Cost: O(bytes). [`work`](Self::work) must keep up: a complete frame is dropped if the next one begins before it
    /// was checked.
    pub fn receive(&mut self, bytes: &[u8], now: Millis) {
        for &byte in bytes {
            let outcome = match self.deframer.push(byte) {
                None => continue,
                Some(Ok(packet)) => self.assembler.accept(packet, now).ok(),
                Some(Err(error)) => {
                    self.assembler.count_framing(&error);
                    None
                }
            };
            self.note(outcome);
        }
    }

    /// Takes one packet, from a bus that delivers whole packets.
    ///
    /// Cost: O(bytes).
    ///
    /// # Errors
    /// [`ReceiveError`] tells why the packet or its frame was rejected; the event has been counted.
    pub fn packet(&mut self, packet: &[u8], now: Millis) -> Result<Progress, ReceiveError> {
        let outcome = self.assembler.accept(packet, now);
        self.note(outcome.ok());
        outcome
    }

    /// Takes a whole frame from this process, for example from a solver's thread: the positions (mm) of all vertices of
    /// the mesh's file, or of all nodes, in that file's order, captured at `captured` on the receiver's clock.
    /// [`work`](Self::work) then checks and publishes it like a frame of packets.
    ///
    /// The call counts as a sign of life, and its transit time is 0. Use one source at a time: a frame of packets that
    /// is still being received is abandoned.
    ///
    /// Cost: O(rows), several reads of each row. There is no lock: the control tick reads the last surface meanwhile.
    ///
    /// # Errors
    /// [`ReceiveError`], as [`Assembler::frame`]: it has been counted, and the last good surface stays.
    /// [`RowCount`](ReceiveError::RowCount) if the number of positions is not
    /// [`Tree::file_vertex_count`](crate::Tree::file_vertex_count), or the number of nodes.
    pub fn frame<P: Copy + Into<Vec3>>(
        &mut self,
        positions: &[P],
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        self.take(positions, None, [captured, now])
    }

    fn take<P: Copy + Into<Vec3>>(
        &mut self,
        positions: &[P],
        pose: Option<RigidPose>,
        [captured, now]: [Millis; 2],
    ) -> Result<Progress, ReceiveError> {
        let outcome = match self.order.rows(positions) {
            Some(rows) => self.assembler.frame_at(rows, (pose, 0.0), [captured, now]),
            None => {
                let rows = u32::try_from(positions.len()).unwrap_or(u32::MAX);
                Err(self.assembler.refuse_frame(ReceiveError::RowCount { rows }, now))
            }
        };
        self.note(outcome.ok());
        outcome
    }

    /// Takes a frame of this process by the weights of the tree's displacement modes: all vertices are computed, and the
    /// modes' own [`position_error`](Modes::position_error) is part of each answer's accuracy. Otherwise the same as
    /// [`frame`](Self::frame). An [`Assembler`] with a [`ModalAdmissionCheck`](crate::modes::ModalAdmissionCheck)
    /// stores the weights alone.
    ///
    /// Cost: O(vertices times modes), several times.
    ///
    /// # Errors
    /// [`ReceiveError`], counted; the last good surface stays. [`RowCount`](ReceiveError::RowCount) for another number of
    /// weights than modes; [`NotFinite`](ReceiveError::NotFinite), or [`TooFar`](ReceiveError::TooFar) for a weight out of
    /// its [range](Modes::range), with the mode as `row`; [`WrongMesh`](ReceiveError::WrongMesh) for another tree's modes.
    #[cfg(feature = "modes")]
    pub fn frame_of_weights(
        &mut self,
        modes: &Modes<'_>,
        weights: &[f32],
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        self.take_weights((modes, weights), None, [captured, now])
    }

    #[cfg(feature = "modes")]
    fn take_weights(
        &mut self,
        (modes, weights): (&Modes<'_>, &[f32]),
        pose: Option<RigidPose>,
        [captured, now]: [Millis; 2],
    ) -> Result<Progress, ReceiveError> {
        let outcome = match surface_of(modes, weights, self.assembler.tree_checksum()) {
            Ok(surface) => {
                // Every row is in the table.
                let at = |row| surface.position(row).unwrap_or(Vec3::NAN);
                let rows = (0..modes.vertex_count()).map(at);
                let besides = (pose, surface.position_error());
                self.assembler.frame_at(rows, besides, [captured, now])
            }
            Err(refusal) => Err(self.assembler.refuse_frame(refusal, now)),
        };
        self.note(outcome.ok());
        outcome
    }

    fn note(&mut self, outcome: Option<Progress>) {
        self.has_news |= outcome == Some(Progress::Hello);
        self.notes.of_all.link.set(&self.assembler.health());
    }

    /// Does a slice of the checks: at most `work` rows and triangles of the frame being received, and publishes it once
    /// it is complete and admitted. Without a frame it checks the tree's bytes. `Ok(Advance::Pending)` if there is more
    /// work to do at once.
    ///
    /// Cost: O(`work`).
    ///
    /// # Errors
    /// [`ReceiveError::Stretch`] if a surface is refused; it has been counted.
    // Not inlined: in a large loop its branches would become jumps through a register, whose targets no check of the
    // binary finds.
    #[inline(never)]
    pub fn work(&mut self, work: u32) -> Result<Advance, ReceiveError> {
        let outcome = self.assembler.advance(work);
        self.notes.of_all.link.set(&self.assembler.health());
        match outcome {
            Ok(Advance::Pending | Advance::Held { .. }) => (),
            Ok(Advance::Idle) => self.check_tree(work),
            Ok(Advance::Published { .. }) | Err(_) => self.has_news = true,
        }
        outcome
    }

    fn check_tree(&mut self, work: u32) {
        let bytes = work.saturating_mul(SCRUBBED) as usize;
        if self.scrub.step(bytes).is_err() {
            self.notes.of_all.set_tree_corrupt();
        }
    }

    /// The status that is due for the sender, of at most `BYTES`; `None` unless a frame was published or refused, the
    /// sender asked, or 100 ms have passed. The sender's next frame echoes it, which measures the transit time of
    /// frames.
    pub fn status<'b, const BYTES: usize>(
        &mut self,
        now: Millis,
        packet: &'b mut [u8; BYTES],
    ) -> Option<&'b [u8]> {
        if !self.has_news && now.since(self.reported) < INTERVAL {
            return None;
        }
        (self.reported, self.has_news) = (now, false);
        let status = self.assembler.status(now, self.notes.of_all.safety());
        let (counters, mac) = (self.assembler.counters(), self.assembler.mac());
        let mesh_id = self.assembler.mesh_id();
        Some(encode_status(mesh_id, &status, counters, mac, packet))
    }

    /// The same, framed for a byte stream.
    pub fn status_framed<'b>(
        &mut self,
        now: Millis,
        line: &'b mut [u8; framed_bytes(STATUS)],
    ) -> Option<&'b [u8]> {
        let mut packet = [0_u8; STATUS];
        enframe(self.status(now, &mut packet)?, line)
    }

    /// The events since the start, by cause.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        self.assembler.counters()
    }

    /// The last published frame.
    #[must_use]
    pub fn surface(&self) -> Option<FrameView<'_>> {
        self.assembler.surface()
    }

    /// Completed passes of the check of the tree's bytes; wraps.
    #[must_use]
    pub const fn rounds(&self) -> u32 {
        self.scrub.rounds()
    }

    /// Registers the surface anew, as [`Assembler::register`]: only an operator may decide this.
    pub const fn register(&mut self) {
        self.assembler.register();
    }
}

impl<I: Index, M: Mac, R: Rows<Poses = ()>> Bus<'_, '_, I, M, PosedRows<R>> {
    /// As [`frame`](Self::frame), with a pose of the whole mesh: a position `p` is at `rotation p + shift`. A frame
    /// without a pose is in the coordinates of the mesh's file.
    ///
    /// # Errors
    /// Also [`ReceiveError::Pose`] if the rotation and shift are not a [`RigidPose`].
    pub fn frame_at<P: Copy + Into<Vec3>>(
        &mut self,
        positions: &[P],
        (rotation, shift): (Quat, Vec3),
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        let pose = self.pose(rotation, shift, now)?;
        self.take(positions, Some(pose), [captured, now])
    }

    /// As [`frame_of_weights`](Self::frame_of_weights), with a pose of the whole mesh.
    ///
    /// # Errors
    /// Also [`ReceiveError::Pose`] if the rotation and shift are not a [`RigidPose`].
    #[cfg(feature = "modes")]
    pub fn frame_of_weights_at(
        &mut self,
        modes: &Modes<'_>,
        weights: &[f32],
        (rotation, shift): (Quat, Vec3),
        captured: Millis,
        now: Millis,
    ) -> Result<Progress, ReceiveError> {
        let pose = self.pose(rotation, shift, now)?;
        self.take_weights((modes, weights), Some(pose), [captured, now])
    }

    fn pose(
        &mut self,
        rotation: Quat,
        shift: Vec3,
        now: Millis,
    ) -> Result<RigidPose, ReceiveError> {
        RigidPose::new(rotation, shift).map_err(|error| {
            let refused = self.assembler.refuse_frame(ReceiveError::Pose(error), now);
            self.note(None);
            refused
        })
    }
}

/// The surface at these weights, for a receiver of the tree with this checksum.
#[cfg(feature = "modes")]
fn surface_of<'a>(
    modes: &Modes<'a>,
    weights: &[f32],
    tree: Option<u32>,
) -> Result<ModalSurface<'a, MAX_MODES>, ReceiveError> {
    // Another tree of the same mesh may have its rows in another order.
    if tree.is_some_and(|tree| tree != modes.tree_checksum()) {
        return Err(ReceiveError::WrongMesh { mesh_id: modes.mesh_id() });
    }
    modes.surface(weights).map_err(|error| match error {
        WeightsError::Count { found: rows, .. } | WeightsError::Capacity { needed: rows, .. } => {
            ReceiveError::RowCount { rows }
        }
        WeightsError::NotFinite { mode: row } => ReceiveError::NotFinite { row },
        WeightsError::OutOfRange { mode: row, .. } => ReceiveError::TooFar { row },
    })
}

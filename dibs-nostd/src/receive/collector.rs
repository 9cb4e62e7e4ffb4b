//! Which frames, packets and hellos are accepted, when a frame is complete, and the receiver's status.
//!
//! Of a frame's content it only uses whether it is partial.
//!
//! One file, because the order of its checks is the protocol's.

// Requirement: B-01

mod heartbeats;

use super::ReceiveError;
use super::arrivals::{Arrivals, PacketPosition, PlacementError};
use super::health::{BusHealth, FrameName, Trouble};
use crate::surface::{AHEAD, Millis, elapsed};
use crate::tree::SurfaceFacts;
use crate::wire::{
    Begin, Commit, Content, Counters, Event, FrameId, Hello, Mac, POSE_SEQUENCE, Packet,
    PublishedStatus, Status, StatusAnswer, is_newer,
};

pub use heartbeats::LastHeartbeat;

#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub id: FrameId,
    pub begin: Begin,
    /// The receiver's clock at the begin packet.
    received: Millis,
    /// The receiver's clock at the last accepted packet.
    touched: Millis,
    /// Checksum of the begin packet: distinguishes a repeated begin from that of a restarted sender.
    begin_checksum: u32,
    /// Sum of the packets' contributions so far.
    sum: u32,
    pub arrivals: Arrivals,
    /// The commit's sequence number and digest, once received.
    commit: Option<(u16, u32)>,
    /// All packets have arrived, and the digest matches.
    pub is_complete: bool,
    /// Largest error (mm) of a position besides its encoding's.
    pub error: f32,
}

#[derive(Clone, Copy, Debug)]
struct PublishedFrame {
    id: FrameId,
    captured: Millis,
    /// The stated age: below 65,535.
    source_age: u16,
    /// How much earlier this capture is than the latest published one: captures may go back by a clock's jitter, the
    /// latest time does not.
    back: u16,
    transit: Millis,
    /// The greatest age reported: a wrap of the clock does not reduce it.
    oldest: Millis,
}

/// Decides which packets and frames to accept, and counts them.
#[derive(Debug)]
pub(super) struct Collector {
    mesh_id: u32,
    published: Option<PublishedFrame>,
    pub frame: Option<Frame>,
    heartbeat: Option<LastHeartbeat>,
    wants_whole: bool,
    /// The next whole frame is a new registration.
    pub is_registration: bool,
    /// Statuses made so far.
    statuses: u32,
    /// The nonce of the last hello, until a status answers it; stored as bytes to save space.
    hello: Option<[u8; 8]>,
    /// The receiver's clock at the last accepted hello, if any.
    greeted_at: Millis,
    is_greeted: bool,
    /// The last heartbeat refused as not later, if tags are not used.
    straggler: Option<(u32, u32)>,
    /// The receiver's clock at the current packet, and at the last accepted packet.
    now: Millis,
    packet: Option<Millis>,
    /// The latest time at which the sender is known to have been alive.
    alive_at: Option<Millis>,
    trouble: Trouble,
    /// The last refused or abandoned frame, and the cause: also the cause for its later packets.
    refused: Option<(FrameName, Event)>,
    pub counters: Counters,
}

/// Within this time only one hello without a tag is accepted, since anybody can send them. A sender repeats its own
/// after 50 ms.
const GREETING: Millis = Millis(20);

/// Time without a packet after which an earlier frame may replace the one being received.
const PATIENCE: Millis = Millis(100);

/// The longest time by which a capture can be earlier than a published one: more than any age that a packet states. On
/// a clock that wraps, a longer step back is a step forward.
const EARLIEST: Millis = Millis(1 << 17);

impl Collector {
    pub const fn new(mesh_id: u32) -> Self {
        Self {
            mesh_id,
            published: None,
            frame: None,
            heartbeat: None,
            wants_whole: false,
            is_registration: false,
            statuses: 0,
            hello: None,
            greeted_at: Millis(0),
            is_greeted: false,
            straggler: None,
            now: Millis(0),
            packet: None,
            alive_at: None,
            trouble: Trouble::new(),
            refused: None,
            counters: Counters::new(),
        }
    }

    /// Sets the clock.
    pub const fn set_now(&mut self, now: Millis) {
        self.now = now;
    }

    /// Notes an accepted packet.
    pub const fn note_packet(&mut self) {
        self.packet = Some(self.now);
    }

    /// Counts bytes that are no packet.
    #[cold]
    pub fn refuse_bytes(&mut self, event: Event) {
        self.counters.count(event);
    }

    /// Counts a rejection of the begin or another packet of the frame with this name.
    #[cold]
    pub fn refuse<M: Mac>(&mut self, name: FrameName, is_begin: bool, rejection: &ReceiveError) {
        if is_begin || rejection.ends_frame() {
            self.refused = Some((name, rejection.event()));
        }
        self.counters.count(rejection.event());
        self.trouble.note(name, rejection, M::TAGGED, self.now);
    }

    /// Accepts a hello.
    pub fn hello<M: Mac>(
        &mut self,
        packet: &Packet<'_>,
        hello: Hello,
        mac: &M,
    ) -> Result<(), ReceiveError> {
        if !packet.is_genuine(mac, hello.session) {
            return Err(ReceiveError::Forged { epoch: packet.epoch });
        }
        // The latest hello is answered, so that strangers with many hellos do not keep a sender from its answer.
        self.hello = Some(hello.nonce.to_le_bytes());
        let after = self.now.since(self.greeted_at);
        if !M::TAGGED && self.is_greeted && after < GREETING {
            return Err(ReceiveError::Throttled { after });
        }
        (self.greeted_at, self.is_greeted) = (self.now, true);
        Ok(())
    }

    /// The numbers for a fail-safe machine.
    ///
    /// A complete frame counts from before its publication, where it is the worse: a control tick that interrupts the bus
    /// right after it reads the new surface beside the numbers noted before.
    pub fn health(&self) -> BusHealth {
        let (mut transit, mut source_age) = match &self.published {
            Some(published) => (published.transit, Millis(published.source_age.into())),
            None => (Millis::MAX, Millis::MAX),
        };
        if let Some(frame) = self.frame.as_ref().filter(|frame| frame.is_complete) {
            transit = transit.max(frame.transit());
            source_age = source_age.max(Millis(frame.begin.freshness.age_ms.into()));
        }
        let (rejections, forgeries) = self.trouble.counts(self.now);
        BusHealth {
            packet: self.packet,
            heartbeat: self.alive_at,
            rejections,
            forgeries,
            transit,
            source_age,
        }
    }

    pub fn check_mesh(&self, packet: &Packet<'_>) -> Result<(), ReceiveError> {
        if packet.mesh_id == self.mesh_id {
            return Ok(());
        }
        Err(ReceiveError::WrongMesh { mesh_id: packet.mesh_id })
    }

    /// Starts a frame from a genuine begin, with its checksum and its contribution to the digest; `None` for a repeated
    /// begin. `is_acceptable` does this receiver's checks.
    pub fn begin<M: Mac>(
        &mut self,
        epoch: u32,
        begin: Begin,
        [checksum, contribution]: [u32; 2],
        is_acceptable: impl FnOnce(&Begin) -> Result<(), ReceiveError>,
    ) -> Result<Option<Frame>, ReceiveError> {
        let id = FrameId { mesh_id: self.mesh_id, session: begin.session, epoch };
        if self.published.is_some_and(|published| !id.is_after(&published.id)) {
            return Err(ReceiveError::Stale { epoch });
        }
        is_acceptable(&begin)?;
        let age_ms = begin.freshness.age_ms;
        if age_ms == u16::MAX {
            return Err(ReceiveError::TooOld);
        }
        let captured = self.now.before(Millis(age_ms.into()));
        if let Some(Err(by)) = self.since_newest(captured)
            && by > AHEAD
        {
            return Err(ReceiveError::Earlier { by });
        }
        if let Content::Partial { base_epoch } = begin.content {
            let base = FrameId { epoch: base_epoch, ..id };
            if self.published.is_none_or(|published| published.id != base) {
                self.wants_whole = true;
                return Err(ReceiveError::Base { epoch: base_epoch });
            }
        }
        if let Some(frame) = &self.frame {
            if frame.id == id && frame.begin_checksum == checksum {
                return Ok(None);
            }
            if frame.is_complete {
                return Err(ReceiveError::Busy { epoch });
            }
            if frame.id.is_after(&id) && self.now.since(frame.touched) < PATIENCE {
                return Err(ReceiveError::Stale { epoch });
            }
            self.counters.count(Event::Abandoned);
            self.refused = Some((FrameName::of(&frame.id), Event::Abandoned));
            self.trouble.note_frame(FrameName::of(&frame.id), M::TAGGED);
        }
        let frame = Frame {
            id,
            begin,
            received: self.now,
            touched: self.now,
            begin_checksum: checksum,
            sum: contribution,
            arrivals: Arrivals::new(!matches!(begin.content, Content::Partial { .. })),
            commit: None,
            is_complete: false,
            error: 0.0,
        };
        self.frame = Some(frame);
        Ok(Some(frame))
    }

    /// The name of the next frame of this process: later than all received ones.
    pub fn next_id(&self) -> FrameId {
        // A frame in work is later than the published one: `begin` refuses every other.
        let later = self.frame.as_ref().map(|frame| frame.id).or(self.published_id());
        let first = FrameId { mesh_id: self.mesh_id, session: 0, epoch: 1 };
        later.map_or(first, |last| FrameId { epoch: last.epoch.wrapping_add(1), ..last })
    }

    /// The position of all rows of the current frame, received at once together with its commit.
    pub fn locate_whole(&mut self, rows: u32) -> Option<PacketPosition> {
        let frame = self.frame.as_mut()?;
        frame.commit = Some((2, frame.sum));
        frame.arrivals.locate(1, 0..rows).ok()
    }

    /// States the error (mm) of the current frame's positions.
    pub fn set_error(&mut self, error: f32) {
        if let Some(frame) = &mut self.frame {
            frame.error = error;
        }
    }

    /// Notes a frame of this process, which is its sign of life.
    pub fn note_local(&mut self) {
        self.note_packet();
        self.note_alive(None);
    }

    /// The current frame and the packet's contribution to its digest, if the packet belongs to it.
    #[inline]
    pub fn frame_of<M: Mac>(
        &self,
        packet: &Packet<'_>,
        mac: &M,
    ) -> Result<(&Frame, u32), ReceiveError> {
        let epoch = packet.epoch;
        match &self.frame {
            Some(frame)
                if frame.id.epoch == epoch && frame.id.session as u16 == packet.session_low =>
            {
                let contribution = packet.verify(mac, frame.id.session);
                contribution
                    .map(|contribution| (frame, contribution))
                    .ok_or(ReceiveError::Forged { epoch })
            }
            _ => {
                let is_stale = self.published.is_some_and(|published| {
                    published.id.session as u16 == packet.session_low
                        && !is_newer(epoch, published.id.epoch)
                });
                if is_stale {
                    return Err(ReceiveError::Stale { epoch });
                }
                let refused =
                    self.refused.filter(|(name, _)| *name == FrameName::of_packet(packet));
                let cause = refused.map(|(_, cause)| cause);
                let unexpected = match cause {
                    Some(cause) => ReceiveError::Refused { epoch, cause },
                    None => ReceiveError::Unexpected { epoch },
                };
                match self.session_of(packet.session_low) {
                    _ if !M::TAGGED => Err(unexpected),
                    Some(session) if packet.is_genuine(mac, session) => Err(unexpected),
                    None if packet.is_tagged() => Err(ReceiveError::Unverifiable { epoch, cause }),
                    _ => Err(ReceiveError::Forged { epoch }),
                }
            }
        }
    }

    /// The known session with this low half.
    fn session_of(&self, low: u16) -> Option<u32> {
        let in_work = self.frame.as_ref().map(|frame| frame.id.session);
        let published = self.published.as_ref().map(|published| published.id.session);
        let alive = self.heartbeat.map(|last| last.session);
        let mut known = [in_work, published, alive].into_iter().flatten();
        known.find(|&session| session as u16 == low)
    }

    /// Notes stored rows. `Ok(true)` once the frame is complete.
    #[inline]
    pub fn take_rows(
        &mut self,
        contribution: u32,
        position: PacketPosition,
    ) -> Result<bool, ReceiveError> {
        let Some(frame) = &mut self.frame else { return Ok(false) };
        frame.arrivals.insert(position);
        frame.sum = frame.sum.wrapping_add(contribution);
        frame.touched = self.now;
        self.finish()
    }

    /// Accepts the commit: `None` for a repeated one, `Some(true)` once the frame is complete.
    pub fn commit<M: Mac>(
        &mut self,
        packet: &Packet<'_>,
        commit: Commit,
        mac: &M,
    ) -> Result<Option<bool>, ReceiveError> {
        self.frame_of(packet, mac)?;
        let Some(frame) = &mut self.frame else { return Ok(None) };
        let sequence = packet.sequence;
        // A commit at or before the pose's sequence number is without a pose.
        if frame.begin.is_posed && sequence <= POSE_SEQUENCE {
            return Err(ReceiveError::Order { sequence });
        }
        match frame.commit {
            Some((known, _)) if known == sequence => return Ok(None),
            Some(_) => return Err(ReceiveError::Order { sequence }),
            None if frame.arrivals.reaches(sequence) => {
                return Err(ReceiveError::Order { sequence });
            }
            None => frame.commit = Some((sequence, commit.digest)),
        }
        frame.touched = self.now;
        self.finish().map(Some)
    }

    #[cfg(feature = "control")]
    pub const fn mesh_id(&self) -> u32 {
        self.mesh_id
    }

    /// Whether the frame is complete. Drops a complete frame whose rows or digest are wrong.
    #[inline]
    fn finish(&mut self) -> Result<bool, ReceiveError> {
        let Some(frame) = &mut self.frame else { return Ok(false) };
        let Some((sequence, stated)) = frame.commit else { return Ok(false) };
        if frame.arrivals.next() != sequence {
            return Ok(false);
        }
        let computed = frame.sum;
        let rows = frame.arrivals.ready();
        if stated != computed {
            self.frame = None;
            return Err(ReceiveError::Digest { stated, computed });
        }
        if !frame.is_partial() && rows != frame.begin.rows {
            self.frame = None;
            return Err(ReceiveError::RowCount { rows });
        }
        frame.is_complete = true;
        Ok(true)
    }

    /// Makes the current frame the published one.
    pub fn published(&mut self, frame: &Frame) {
        self.frame = None;
        self.wants_whole = false;
        self.is_registration &= frame.is_partial();
        let back = match self.since_newest(frame.captured()) {
            // At most a clock's jitter, otherwise the frame would have been refused.
            Some(Err(Millis(by))) => by as u16,
            _ => 0,
        };
        self.trouble.note_published(self.published.is_none());
        self.published = Some(PublishedFrame {
            id: frame.id,
            captured: frame.captured(),
            back,
            source_age: frame.begin.freshness.age_ms,
            transit: frame.transit(),
            oldest: Millis(0),
        });
        // The published session is the sender's: a heartbeat of another session was stray.
        self.heartbeat = self.heartbeat.filter(|last| last.session == frame.id.session);
        self.counters.count(Event::Published);
    }

    /// The time from the latest published capture to this one, or how much earlier this one is.
    fn since_newest(&self, captured: Millis) -> Option<Result<Millis, Millis>> {
        let PublishedFrame { captured: last, back, .. } = self.published?;
        let newest = last.after(Millis(back.into()));
        let by = newest.since(captured);
        let is_earlier = by > Millis(0) && by <= EARLIEST;
        Some(if is_earlier { Err(by) } else { Ok(captured.since(newest)) })
    }

    /// The time between the captures of the published frame and the current one: 0 if the current one is earlier.
    pub fn time_to(&self, frame: &Frame) -> Option<Millis> {
        let time = self.since_newest(frame.captured())?;
        Some(time.unwrap_or(Millis(0)))
    }

    /// The next whole frame is a new registration.
    pub const fn register(&mut self) {
        self.is_registration = true;
    }

    pub fn want_whole(&mut self) {
        self.wants_whole = true;
    }

    pub fn published_id(&self) -> Option<FrameId> {
        self.published.map(|published| published.id)
    }

    pub const fn last_heartbeat(&self) -> Option<LastHeartbeat> {
        self.heartbeat
    }

    /// The status for the sender; `stretch` is the published frame's.
    pub fn status(
        &mut self,
        now: Millis,
        safety: u8,
        stretch: Option<f32>,
        challenge: u64,
        surface: SurfaceFacts,
    ) -> Status {
        let number = self.statuses;
        self.statuses = number.wrapping_add(1);
        let published = self.published.as_mut().map(|published| {
            let age = now.since(published.captured);
            published.oldest = if age < published.oldest { Millis::MAX } else { age };
            PublishedStatus {
                session: published.id.session,
                epoch: published.id.epoch,
                age_ms: published.oldest.0,
                stretch: stretch.filter(|_| self.hello.is_none()),
            }
        });
        let nonce = self.hello.take().map(u64::from_le_bytes);
        let answer = nonce.map(|nonce| StatusAnswer { nonce, challenge, surface });
        Status { published, wants_whole: self.wants_whole, safety, number, clock: now.0, answer }
    }
}

impl Frame {
    pub const fn is_partial(&self) -> bool {
        matches!(self.begin.content, Content::Partial { .. })
    }

    /// The receiver's clock at the capture, assuming that the begin had no transit time.
    pub fn captured(&self) -> Millis {
        self.received.before(Millis(self.begin.freshness.age_ms.into()))
    }

    /// The time from the status that the begin echoes to its arrival; [`Millis::MAX`] without an echo.
    fn transit(&self) -> Millis {
        let transit = self.begin.freshness.echo.map(|echo| elapsed(self.received, Millis(echo)));
        // An echo from the future comes from another run of this receiver.
        transit.filter(|transit| transit.0 <= i32::MAX as u32).unwrap_or(Millis::MAX)
    }

    /// The position of rows; `None` for a repeated packet.
    #[inline]
    pub fn locate(
        &self,
        sequence: u16,
        rows: core::ops::Range<u32>,
    ) -> Result<Option<PacketPosition>, ReceiveError> {
        if self.commit.is_some_and(|(commit, _)| sequence >= commit) {
            return Err(ReceiveError::Order { sequence });
        }
        // This sequence number of a posed frame is its pose, without rows.
        if self.begin.is_posed && sequence == POSE_SEQUENCE && !rows.is_empty() {
            return Err(ReceiveError::Order { sequence });
        }
        match self.arrivals.locate(sequence, rows) {
            Ok(position) => Ok(Some(position)),
            Err(PlacementError::Duplicate) => Ok(None),
            Err(PlacementError::Order) => Err(ReceiveError::Order { sequence }),
            Err(PlacementError::Gaps) => Err(ReceiveError::Gaps { sequence }),
        }
    }
}

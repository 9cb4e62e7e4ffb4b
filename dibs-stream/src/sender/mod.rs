//! Sends frames, and reads the statuses on the way back.

// Requirement: B-09

mod clock;
mod error;
mod frame;
mod greeting;
mod objection;
mod order;
mod prepare;
mod reply;
mod settings;
mod totals;

pub use error::SendError;
pub use frame::{PreparedFrame, SentFrame};
pub use order::SurfaceOrder;
pub use settings::Settings;
pub use totals::Totals;

use std::fmt;
use std::time::Duration;

use dibs_nostd::RigidPose;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Content, Counters, Encoding, FrameId, Freshness, Mac, NoMac, QuantisedBox, Status,
    encode_heartbeat,
};

use crate::transport::Transport;
use clock::Clock;
use frame::{Packets, coarsened};
use greeting::Greeting;
use objection::Objection;

/// Sends the frames of a moving surface, in packets of at most `MTU` bytes, and receives statuses.
///
/// ```
/// use dibs_stream::{Sender, Settings, SurfaceOrder};
/// use dibs_build::{Builder, generate};
///
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(500)?;
/// let tree = Builder::new().build(&heart)?;
/// let order = SurfaceOrder::of(&tree.tree::<u16>()?);
/// // A `Vec` collects the packets; `Target::open` gives a line.
/// let mut sender = Sender::<_, 64>::new(Vec::new(), order, Settings::default());
/// for frame in &motion.frames {
///     sender.send(frame)?; // positions in the mesh's order
///     sender.poll()?; // heartbeats there, statuses back
/// }
/// assert_eq!(sender.totals().frames, motion.frames.len() as u64);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Sender<T, const MTU: usize, M = NoMac> {
    transport: T,
    /// `None` until the receiver's challenge is known.
    mac: Option<M>,
    /// Returns the MAC for a challenge.
    keyed_mac: Box<dyn Fn(u64) -> M + Send>,
    clock: Clock,
    /// The hello that has no answer yet.
    greeting: Option<Greeting>,
    surface: SurfaceOrder,
    settings: Settings,
    epoch: u32,
    /// The epoch before the session's first.
    before: u32,
    /// Whether a frame of this session was acknowledged.
    is_established: bool,
    /// Why the receiver refuses this sender's frames.
    objection: Option<Objection>,
    /// Whether an answer has shown that the receiver has the same surface.
    is_compared: bool,
    beat: u32,
    last_beat: Option<Duration>,
    /// The last positions or weights, and the time when they were first given.
    capture: Option<(Vec<f32>, Duration)>,
    /// The last frame of positions, as the receiver has it if all packets arrived.
    held: Option<(u32, Vec<Vec3>)>,
    /// Memory for the next frame: its rows and its packets.
    memory: (Vec<Vec3>, Packets),
    since_whole: u32,
    whole_wanted: bool,
    /// Whether the last frame had a pose: a partial frame without one would keep it.
    has_pose: bool,
    /// The last whole frame and its time. Until it is acknowledged, requests for a whole frame may be older than it.
    whole: Option<(u32, Duration)>,
    status: Option<Status>,
    counters: Counters,
    totals: Totals,
}

/// Omits the key.
impl<T: fmt::Debug, const MTU: usize, M> fmt::Debug for Sender<T, MTU, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut sender = f.debug_struct("Sender");
        sender.field("transport", &self.transport).field("epoch", &self.epoch);
        sender.field("totals", &self.totals).finish_non_exhaustive()
    }
}

impl<T: Transport, const MTU: usize> Sender<T, MTU> {
    /// A sender that has not sent anything.
    #[must_use]
    pub fn new(transport: T, surface: SurfaceOrder, settings: Settings) -> Self {
        let sender = Self::with_mac(transport, surface, settings, |_| NoMac);
        Self { mac: Some(NoMac), ..sender }
    }
}

impl<T: Transport, M: Mac, const MTU: usize> Sender<T, MTU, M> {
    /// A sender of packets with tags. `keyed_mac(challenge)` returns the MAC under the receiver's challenge, which the
    /// receiver chooses when it starts and reports in its answer to a hello. Until an answer arrives,
    /// [`poll`](Self::poll) sends hellos, and no frame can be sent.
    ///
    /// For a receiver without a return channel, which uses the challenge 0: [`challenge`](Self::challenge).
    #[must_use]
    pub fn with_mac(
        transport: T,
        surface: SurfaceOrder,
        settings: Settings,
        keyed_mac: impl Fn(u64) -> M + Send + 'static,
    ) -> Self {
        Self {
            transport,
            mac: None,
            keyed_mac: Box::new(keyed_mac),
            clock: Clock::system(),
            greeting: None,
            surface,
            settings,
            epoch: 0,
            before: 0,
            is_established: false,
            objection: None,
            is_compared: false,
            beat: 0,
            last_beat: None,
            capture: None,
            held: None,
            memory: Default::default(),
            since_whole: 0,
            whole_wanted: true,
            has_pose: false,
            whole: None,
            status: None,
            counters: Counters::new(),
            totals: Totals::default(),
        }
    }

    /// Sets the receiver's challenge.
    pub fn challenge(&mut self, challenge: u64) {
        self.mac = Some((self.keyed_mac)(challenge));
    }

    /// Uses `now` instead of the system's clock, for tests and simulations. It may start at any time, but must not go
    /// back.
    #[must_use]
    pub fn with_clock(mut self, now: impl Fn() -> Duration + Send + 'static) -> Self {
        self.clock = Clock::of(now);
        self
    }

    /// Continues on another transport, with a whole frame as soon as the receiver has answered. Returns the broken
    /// transport.
    pub fn reconnect(&mut self, transport: T) -> T {
        self.whole_wanted = true;
        self.greeting = Some(Greeting::new());
        std::mem::replace(&mut self.transport, transport)
    }

    /// Whether frames can be sent: without tags always, with tags once the challenge is known.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        self.mac.is_some()
    }

    /// Sends a frame of positions (mm) in the mesh's order: whole or partial, as settings and receiver require, with
    /// heartbeats between its packets when due.
    ///
    /// The frame counts as captured now, unless its positions equal the last frame's in every bit: then it counts as
    /// captured at the same time as the last one. So a source that stops moving ages, although its sender is alive. If
    /// the time of capture is known, use [`send_captured`](Self::send_captured).
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent, or the line's error.
    pub fn send(&mut self, positions: &[Vec3]) -> Result<SentFrame, SendError> {
        let frame = self.prepare(positions)?;
        self.transmit(frame)
    }

    /// Sends a frame that was captured some time ago.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn send_captured(
        &mut self,
        positions: &[Vec3],
        ago: Duration,
    ) -> Result<SentFrame, SendError> {
        let frame = self.prepare_captured(positions, ago)?;
        self.transmit(frame)
    }

    /// Sends a frame that was captured some time ago, with a rigid pose of the whole surface: the positions are in the
    /// mesh's own coordinates. For a receiver of [`PosedRows`](dibs_nostd::guard::PosedRows).
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn send_at(
        &mut self,
        positions: &[Vec3],
        pose: RigidPose,
        ago: Duration,
    ) -> Result<SentFrame, SendError> {
        let frame = self.prepare_at(positions, pose, ago)?;
        self.transmit(frame)
    }

    /// Sends a prepared frame, with heartbeats between its packets when due.
    ///
    /// # Errors
    /// [`SendError::Line`] when the connection is lost.
    pub fn transmit(&mut self, frame: PreparedFrame) -> Result<SentFrame, SendError> {
        self.transmit_paced(frame, || ())
    }

    /// The same, but calls `wait` before each packet: a [`Pace`](super::Pace) spreads them.
    ///
    /// # Errors
    /// As [`transmit`](Self::transmit).
    pub fn transmit_paced(
        &mut self,
        frame: PreparedFrame,
        mut wait: impl FnMut(),
    ) -> Result<SentFrame, SendError> {
        let PreparedFrame { sent, packets } = frame;
        for packet in packets.iter() {
            wait();
            self.heartbeat()?;
            self.put(packet)?;
        }
        self.memory.1 = packets;
        if sent.content == Content::Whole {
            self.whole = Some((sent.epoch, self.clock.now()));
        }
        self.totals.partial += u64::from(matches!(sent.content, Content::Partial { .. }));
        self.totals.frames += 1;
        Ok(sent)
    }

    /// Sends a heartbeat or a hello if one is due, and receives the statuses that have arrived. Does not block. Call it
    /// a few times between two heartbeats.
    ///
    /// # Errors
    /// [`SendError::Line`] when the connection is lost, [`SendError::Superseded`] while another sender has taken over,
    /// [`SendError::OtherSurface`] while the receiver has another surface.
    pub fn poll(&mut self) -> Result<(), SendError> {
        self.greet()?;
        self.heartbeat()?;
        while let Some(packet) = self.transport.receive().map_err(SendError::Line)? {
            self.take(&packet);
        }
        self.object()
    }

    /// Totals since the start.
    #[must_use]
    pub const fn totals(&self) -> &Totals {
        &self.totals
    }

    /// The last frame of positions, as the receiver has it if all packets arrived: its epoch, and the positions in the
    /// order of the rows.
    #[must_use]
    pub fn held(&self) -> Option<(u32, &[Vec3])> {
        self.held.as_ref().map(|(epoch, held)| (*epoch, held.as_slice()))
    }

    /// The transport.
    pub const fn transport(&mut self) -> &mut T {
        &mut self.transport
    }

    /// Makes the next frame a whole one.
    pub const fn want_whole(&mut self) {
        self.whole_wanted = true;
    }

    fn id(&self) -> FrameId {
        let Settings { session, .. } = self.settings;
        FrameId { mesh_id: self.surface.mesh_id, session, epoch: self.epoch }
    }

    fn next_id(&mut self) -> FrameId {
        self.epoch = self.epoch.wrapping_add(1);
        self.id()
    }

    fn is_partial_wanted(&self) -> bool {
        self.settings.partial.is_some()
            && !self.whole_wanted
            && self.since_whole + 1 < self.settings.whole_every
    }

    fn encoding(&self, rows: &[Vec3]) -> Result<Encoding, SendError> {
        if !self.settings.quantised {
            return Ok(Encoding::Float);
        }
        // There is no box for a position that is not finite; the encoder names it.
        let Some(grid) = QuantisedBox::covering(rows) else { return Ok(Encoding::Float) };
        let tolerance = self.settings.partial.unwrap_or(0.0);
        Ok(Encoding::Quantised(coarsened(grid, tolerance)))
    }

    /// Fails if no frame can be sent.
    fn check(&self) -> Result<(), SendError> {
        self.object()?;
        if self.is_ready() { Ok(()) } else { Err(SendError::NoChallenge) }
    }

    /// Time since these numbers last changed.
    fn since_change(&mut self, numbers: impl Iterator<Item = f32> + Clone) -> Duration {
        let now = self.clock.now();
        let (last, at) = self.capture.get_or_insert_default();
        if numbers.clone().eq(last.iter().copied()) && !last.is_empty() {
            return now.saturating_sub(*at);
        }
        last.clear();
        last.extend(numbers);
        *at = now;
        Duration::ZERO
    }

    fn freshness(&self, age: Duration) -> Freshness {
        let age_ms = u16::try_from(age.as_millis()).unwrap_or(u16::MAX);
        Freshness { age_ms, echo: self.status.map(|status| status.clock) }
    }

    fn heartbeat(&mut self) -> Result<(), SendError> {
        let Some(interval) = self.settings.heartbeat.filter(|_| self.is_ready()) else {
            return Ok(());
        };
        let now = self.clock.now();
        if self.last_beat.is_some_and(|last| now.saturating_sub(last) < interval) {
            return Ok(());
        }
        self.last_beat = Some(now);
        self.beat = self.beat.wrapping_add(1);
        let mut buffer = [0; 64];
        let Some(mac) = &self.mac else { return Ok(()) };
        let echo = self.status.map(|status| status.clock);
        let beat = encode_heartbeat(&self.id(), self.beat, echo, mac, &mut buffer);
        self.put(beat)
    }

    fn put(&mut self, packet: &[u8]) -> Result<(), SendError> {
        self.transport.send(packet).map_err(SendError::Line)?;
        self.totals.count(packet);
        Ok(())
    }
}

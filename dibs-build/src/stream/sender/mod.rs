//! From positions to packets, and what comes back.

mod error;
mod frame;
mod order;
mod settings;

pub use error::SendError;
pub use frame::{Prepared, Sent};
pub use order::SurfaceOrder;
pub use settings::Settings;

use std::time::Instant;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Body, Content, Counters, Encoding, FrameEncoder, FrameId, Mac, NoMac, Packet, QuantisedBox,
    Status, WeightsEncoder, encode_heartbeat, is_newer,
};

use super::Transport;
use frame::{apply, coarsened, packets_of};

/// What was sent since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Frames.
    pub frames: u64,
    /// Of these, partial ones.
    pub partial: u64,
    /// Packets, heartbeats included.
    pub packets: u64,
    /// Bytes, without what a byte stream adds.
    pub bytes: u64,
    /// Statuses that came back.
    pub statuses: u64,
}

/// Sends the frames of a moving surface, in packets of at most `MTU` bytes, and listens to what the
/// receiver reports.
///
/// ```
/// use dibs_build::stream::{Sender, Settings, SurfaceOrder};
/// use dibs_build::{Builder, generate};
///
/// let (heart, motion) = generate::heart(500)?;
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
    /// What makes the tags; `None` until the receiver's challenge is known.
    mac: Option<M>,
    /// What makes tags under a challenge.
    mac_of: Box<dyn Fn(u32) -> M + Send>,
    surface: SurfaceOrder,
    settings: Settings,
    epoch: u32,
    beat: u32,
    last_beat: Option<Instant>,
    /// The last frame of positions, as the receiver has it if it came through.
    held: Option<(u32, Vec<Vec3>)>,
    since_whole: u32,
    whole_wanted: bool,
    /// The last whole frame: until it is acknowledged, requests for one are about the time before it.
    whole: Option<(u32, Instant)>,
    status: Option<Status>,
    counters: Counters,
    totals: Totals,
}

/// Statuses that may be overtaken on their way.
const OVERTAKEN: u32 = 8;

impl<T: Transport, const MTU: usize> Sender<T, MTU> {
    /// A sender that has sent nothing yet.
    #[must_use]
    pub fn new(transport: T, surface: SurfaceOrder, settings: Settings) -> Self {
        let sender = Self::with_mac(transport, surface, settings, |_| NoMac);
        Self { mac: Some(NoMac), ..sender }
    }
}

impl<T: Transport, M: Mac, const MTU: usize> Sender<T, MTU, M> {
    /// A sender of packets with tags. `mac_of` makes what makes the tags under a challenge: the
    /// receiver's, which it draws when it starts and reports in its status. Until a status has come
    /// nothing can be sent.
    ///
    /// For a receiver without a way back, which uses the challenge 0: [`challenge`](Self::challenge).
    #[must_use]
    pub fn with_mac(
        transport: T,
        surface: SurfaceOrder,
        settings: Settings,
        mac_of: impl Fn(u32) -> M + Send + 'static,
    ) -> Self {
        Self {
            transport,
            mac: None,
            mac_of: Box::new(mac_of),
            surface,
            settings,
            epoch: 0,
            beat: 0,
            last_beat: None,
            held: None,
            since_whole: 0,
            whole_wanted: true,
            whole: None,
            status: None,
            counters: Counters::new(),
            totals: Totals::default(),
        }
    }

    /// Takes a challenge as the receiver's.
    pub fn challenge(&mut self, challenge: u32) {
        self.mac = Some((self.mac_of)(challenge));
    }

    /// Whether frames can be sent: without tags always, with tags once the challenge is known.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        self.mac.is_some()
    }

    /// Sends a frame: positions (mm) in the mesh's order. Whole, or only what moved, as the settings
    /// and the receiver ask for; with heartbeats in between, where they are due.
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent, or what the line said.
    pub fn send(&mut self, positions: &[Vec3]) -> Result<Sent, SendError> {
        let frame = self.prepare(positions)?;
        self.transmit(frame)
    }

    /// The first half of [`send`](Self::send): makes the packets. From here on [`held`](Self::held) is
    /// what the receiver will have. A frame that was prepared must be transmitted next.
    ///
    /// # Errors
    /// [`SendError`] names the vertex that cannot be sent.
    pub fn prepare(&mut self, positions: &[Vec3]) -> Result<Prepared, SendError> {
        if !self.is_ready() {
            return Err(SendError::NoChallenge);
        }
        let rows = self.surface.to_rows(positions)?;
        let encoding = self.encoding(&rows)?;
        let is_partial = self.is_partial_wanted();
        let base = self.held.take().filter(|_| is_partial);
        let id = self.next_id();
        let frame = match &base {
            Some((epoch, held)) => {
                FrameEncoder::partial(id, encoding, &rows[..], *epoch, &held[..])
            }
            None => FrameEncoder::new(id, encoding, &rows[..]),
        };
        let mac = self.mac.as_ref().ok_or(SendError::NoChallenge)?;
        let frame = frame.and_then(|frame| frame.with_mac(mac));
        let packets = packets_of::<_, MTU>(frame.map_err(SendError::Frame)?);

        let content = match base {
            Some((base_epoch, _)) => Content::Partial { base_epoch },
            None => Content::Whole,
        };
        let mut held = base.map_or_else(|| vec![Vec3::ZERO; rows.len()], |(_, held)| held);
        let rows_sent = packets.iter().map(|packet| apply(packet, encoding, &mut held)).sum();
        self.held = Some((id.epoch, held));
        if content == Content::Whole {
            self.since_whole = 0;
            self.whole_wanted = false;
        } else {
            self.since_whole += 1;
        }
        Ok(Prepared::new(id.epoch, content, rows_sent, encoding.error(), packets))
    }

    /// Makes the packets of a modal frame: the weights of the receiver's displacement modes.
    ///
    /// # Errors
    /// [`SendError`] names the weight that cannot be sent.
    pub fn prepare_weights(&mut self, weights: &[f32]) -> Result<Prepared, SendError> {
        let id = self.next_id();
        let mac = self.mac.as_ref().ok_or(SendError::NoChallenge)?;
        let frame = WeightsEncoder::<MTU>::new(id, weights).map_err(SendError::Frame)?;
        let mut frame = frame.with_mac(mac);
        let (mut buffer, mut packets) = ([0; MTU], Vec::new());
        while let Some(packet) = frame.next_packet(&mut buffer) {
            packets.push(packet.to_vec());
        }
        Ok(Prepared::new(id.epoch, Content::Modal, weights.len(), 0.0, packets))
    }

    /// Sends a frame that was prepared, with heartbeats in between, where they are due.
    ///
    /// # Errors
    /// [`SendError::Line`] when the connection is gone.
    pub fn transmit(&mut self, frame: Prepared) -> Result<Sent, SendError> {
        let Prepared { sent, packets } = frame;
        for packet in &packets {
            self.heartbeat()?;
            self.put(packet)?;
        }
        if sent.content == Content::Whole {
            self.whole = Some((sent.epoch, Instant::now()));
        }
        self.totals.partial += u64::from(matches!(sent.content, Content::Partial { .. }));
        self.totals.frames += 1;
        Ok(sent)
    }

    /// Sends a heartbeat if one is due, and takes in the statuses that have come. Does not block;
    /// to be called some times between two heartbeats.
    ///
    /// # Errors
    /// [`SendError::Line`] when the connection is gone.
    pub fn poll(&mut self) -> Result<(), SendError> {
        self.heartbeat()?;
        while let Some(packet) = self.transport.receive().map_err(SendError::Line)? {
            self.take(&packet);
        }
        Ok(())
    }

    /// The frame that the receiver has published, if it has said so in this session.
    #[must_use]
    pub fn acknowledged(&self) -> Option<u32> {
        let published = self.status?.published?;
        (published.session == self.settings.session).then_some(published.epoch)
    }

    /// Frames that were sent and not acknowledged yet, nor a later one.
    #[must_use]
    pub fn in_flight(&self) -> u32 {
        self.epoch.wrapping_sub(self.acknowledged().unwrap_or(0))
    }

    /// What the receiver reported last.
    #[must_use]
    pub const fn status(&self) -> Option<&Status> {
        self.status.as_ref()
    }

    /// The receiver's counters, as far as it has reported them.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// What was sent since the start.
    #[must_use]
    pub const fn totals(&self) -> &Totals {
        &self.totals
    }

    /// The last frame of positions as the receiver has it if all of it came through: its number, and
    /// the positions in the order of its rows.
    #[must_use]
    pub fn held(&self) -> Option<(u32, &[Vec3])> {
        self.held.as_ref().map(|(epoch, held)| (*epoch, held.as_slice()))
    }

    /// What the packets go through.
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
        // A position that is not finite is what is wrong, not the box: the encoder names it.
        let Some(grid) = QuantisedBox::covering(rows) else { return Ok(Encoding::Float) };
        let tolerance = self.settings.partial.unwrap_or(0.0);
        Ok(Encoding::Quantised(coarsened(grid, tolerance)))
    }

    fn heartbeat(&mut self) -> Result<(), SendError> {
        let Some(interval) = self.settings.heartbeat.filter(|_| self.is_ready()) else {
            return Ok(());
        };
        if self.last_beat.is_some_and(|last| last.elapsed() < interval) {
            return Ok(());
        }
        self.last_beat = Some(Instant::now());
        self.beat = self.beat.wrapping_add(1);
        let mut buffer = [0; 64];
        let Some(mac) = &self.mac else { return Ok(()) };
        let beat = encode_heartbeat(&self.id(), self.beat, mac, &mut buffer).to_vec();
        self.put(&beat)
    }

    fn put(&mut self, packet: &[u8]) -> Result<(), SendError> {
        self.transport.send(packet).map_err(SendError::Line)?;
        self.totals.packets += 1;
        self.totals.bytes += packet.len() as u64;
        Ok(())
    }

    /// Takes in a packet that came back. What is no status of this mesh is not for this sender.
    fn take(&mut self, packet: &[u8]) {
        let Ok(packet) = Packet::decode(packet) else { return };
        let Body::Status(report) = packet.body else { return };
        if packet.mesh_id != self.surface.mesh_id {
            return;
        }
        let challenge = report.status.challenge;
        let is_new = self.mac.as_ref().is_none_or(|mac| mac.challenge() != challenge);
        let mac = (self.mac_of)(challenge);
        let session = report.status.published.map_or(0, |published| published.session);
        if !packet.is_genuine(&mac, session) {
            return;
        }
        if is_new {
            // A receiver that has started anew: it has nothing.
            self.mac = Some(mac);
            self.whole_wanted = true;
        }
        // Datagrams may overtake each other; farther back, or with nothing published, is a receiver
        // that has started anew.
        let is_late = report.status.published.is_some()
            && self
                .status
                .is_some_and(|last| last.number.wrapping_sub(report.status.number) < OVERTAKEN);
        if is_late {
            return;
        }
        self.counters.update(&report);
        self.status = Some(report.status);
        self.totals.statuses += 1;
        // Somebody has sent under a later session: this one would be refused for ever.
        if let Some(published) = report.status.published
            && is_newer(published.session, self.settings.session)
        {
            self.settings.session = published.session.wrapping_add(1);
            self.held = None;
            self.whole_wanted = true;
        }
        let is_answered = self.whole.is_some_and(|(epoch, at)| {
            let has_come = self.acknowledged().is_some_and(|newest| !is_newer(epoch, newest));
            has_come || at.elapsed() >= self.settings.patience
        });
        if is_answered && (report.status.wants_whole || self.acknowledged().is_none()) {
            self.whole_wanted = true;
        }
    }
}

//! The bus over Ethernet, polled by the idle loop: the control tick has higher priority, and may interrupt it anywhere.

use controller::network::{
    Content, HARDWARE, MAX_FRAME, MAX_REPLY, Peer, announcement, read, seal,
};
use controller::telemetry;

use crate::lan9118::Lan9118;
use crate::schedule;

/// Most frames received in one iteration of the idle loop.
const FRAMES: u32 = 4;

/// The network, and its counters.
pub struct Network {
    chip: Lan9118,
    /// Sender of the last good packet: statuses are sent to it, and not to others that flood the port.
    peer: Option<Peer>,
    frame: [u8; MAX_FRAME],
    so_far: telemetry::Network,
}

impl Network {
    /// Starts the chip; `None` if there is no chip.
    pub fn start() -> Option<Self> {
        let so_far = telemetry::Network { kind: telemetry::Network::KIND, ..Default::default() };
        let mut chip = Lan9118::start(HARDWARE)?;
        chip.send(&announcement());
        Some(Self { chip, peer: None, frame: [0; MAX_FRAME], so_far })
    }

    /// Receives only a few frames: a flood slows the idle loop's other work down, but does not stop it.
    pub fn poll(&mut self) {
        for _ in 0..FRAMES {
            self.take();
        }
    }

    fn take(&mut self) {
        let start = schedule::own_time();
        let Some(frame) = self.chip.receive(&mut self.frame) else {
            let counts = &mut self.so_far.driver_counts;
            *counts = counts.wrapping_add(schedule::since(start));
            return;
        };
        let so_far = &mut self.so_far;
        so_far.frames = so_far.frames.wrapping_add(1);
        let content = read(frame);
        if let Content::Question(answer) = &content {
            so_far.questions = so_far.questions.wrapping_add(1);
            self.chip.send(answer);
        }
        so_far.driver_counts = so_far.driver_counts.wrapping_add(schedule::since(start));
        if let Content::Packet(packet, from) = content {
            let start = schedule::own_time();
            so_far.packets = so_far.packets.wrapping_add(1);
            if schedule::take(packet) {
                so_far.good = so_far.good.wrapping_add(1);
                self.peer = Some(from);
            }
            so_far.packet_counts = so_far.packet_counts.wrapping_add(schedule::since(start));
        }
    }

    /// Sends a status, if a sender is known.
    pub fn send(&mut self, status: &[u8]) {
        let start = schedule::own_time();
        let mut frame = [0; MAX_REPLY];
        if let Some(frame) = self.peer.and_then(|peer| seal(status, &peer, &mut frame)) {
            self.chip.send(frame);
        }
        self.so_far.driver_counts = self.so_far.driver_counts.wrapping_add(schedule::since(start));
    }

    /// The counters so far.
    pub fn record(&self) -> &telemetry::Network {
        &self.so_far
    }
}

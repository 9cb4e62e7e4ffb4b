//! The bus over Ethernet, polled by the idle loop: the control tick is above it, and interrupts it anywhere.

use controller::network::{
    Content, HARDWARE, MAX_FRAME, MAX_REPLY, Peer, announcement, read, seal,
};
use controller::telemetry;

use crate::lan9118::Lan9118;
use crate::schedule;

/// Frames taken in one round of the idle loop.
const FRAMES: u32 = 4;

/// The network, and its share of the run.
pub struct Network {
    chip: Lan9118,
    /// Sender of the last good packet: statuses go there, and not to whoever floods the port.
    peer: Option<Peer>,
    frame: [u8; MAX_FRAME],
    so_far: telemetry::Network,
}

impl Network {
    /// Starts the chip; `None` if it is not there.
    pub fn start() -> Option<Self> {
        let so_far = telemetry::Network { kind: telemetry::Network::KIND, ..Default::default() };
        let mut chip = Lan9118::start(HARDWARE)?;
        chip.send(&announcement());
        Some(Self { chip, peer: None, frame: [0; MAX_FRAME], so_far })
    }

    /// Takes a few frames at most: a flood slows the idle loop's other work down, and does not stop it.
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

    /// Sends a status, once there is a sender.
    pub fn send(&mut self, status: &[u8]) {
        let start = schedule::own_time();
        let mut frame = [0; MAX_REPLY];
        if let Some(frame) = self.peer.and_then(|peer| seal(status, &peer, &mut frame)) {
            self.chip.send(frame);
        }
        self.so_far.driver_counts = self.so_far.driver_counts.wrapping_add(schedule::since(start));
    }

    /// The network so far.
    pub fn record(&self) -> &telemetry::Network {
        &self.so_far
    }
}

//! The sender's totals.

/// Totals since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Frames.
    pub frames: u64,
    /// Of these, partial ones.
    pub partial: u64,
    /// Packets, heartbeats included.
    pub packets: u64,
    /// Bytes, without a byte stream's framing.
    pub bytes: u64,
    /// Statuses that came back.
    pub statuses: u64,
}

impl Totals {
    /// Counts a packet that was sent.
    pub(super) const fn count(&mut self, packet: &[u8]) {
        self.packets += 1;
        self.bytes += packet.len() as u64;
    }
}

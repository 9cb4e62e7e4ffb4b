//! The sender's totals.

/// Totals since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Frames.
    pub frames: u64,
    /// Partial frames among them.
    pub partial: u64,
    /// Packets, including heartbeats.
    pub packets: u64,
    /// Bytes, without the framing of a byte stream.
    pub bytes: u64,
    /// Statuses received.
    pub statuses: u64,
}

impl Totals {
    /// Counts a packet that was sent.
    pub(super) const fn count(&mut self, packet: &[u8]) {
        self.packets += 1;
        self.bytes += packet.len() as u64;
    }
}

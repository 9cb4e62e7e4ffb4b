//! Counters of the bus for the control tick's records.

use core::sync::atomic::{AtomicU32, Ordering};

use dibs_nostd::wire::{Counters, Event};

/// Counters since the start, written by the bus side. Each is exact, but two of them may have been read at different
/// times.
#[derive(Debug, Default)]
pub struct BusStatus {
    bytes: AtomicU32,
    published: AtomicU32,
    rejected: AtomicU32,
    /// Epoch and digest of a published frame: [`fingerprint`](Self::fingerprint).
    epoch: AtomicU32,
    digest: AtomicU32,
}

impl BusStatus {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: AtomicU32::new(0),
            published: AtomicU32::new(0),
            rejected: AtomicU32::new(0),
            epoch: AtomicU32::new(0),
            digest: AtomicU32::new(0),
        }
    }

    /// Number of bytes received from the bus; wraps.
    #[must_use]
    pub fn bytes(&self) -> u32 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Frames published.
    #[must_use]
    pub fn published(&self) -> u32 {
        self.published.load(Ordering::Relaxed)
    }

    /// Packets and frames rejected.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        self.rejected.load(Ordering::Relaxed)
    }

    /// Epoch of the frame that was last read completely, and the CRC-32 of its positions in memory; epoch 0 if there is
    /// none.
    #[must_use]
    pub fn fingerprint(&self) -> (u32, u32) {
        let epoch = self.epoch.load(Ordering::Acquire);
        let digest = self.digest.load(Ordering::Acquire);
        let is_one = epoch == self.epoch.load(Ordering::Relaxed);
        if is_one { (epoch, digest) } else { (0, 0) }
    }

    pub(crate) fn count_bytes(&self, bytes: usize) {
        let bytes = u32::try_from(bytes).unwrap_or(u32::MAX);
        self.bytes.store(self.bytes().wrapping_add(bytes), Ordering::Relaxed);
    }

    pub(crate) fn set(&self, counters: &Counters) {
        self.published.store(counters.of(Event::Published), Ordering::Relaxed);
        self.rejected.store(counters.rejected(), Ordering::Relaxed);
    }

    pub(crate) fn set_fingerprint(&self, epoch: u32, digest: u32) {
        self.epoch.store(0, Ordering::Relaxed);
        self.digest.store(digest, Ordering::Release);
        self.epoch.store(epoch, Ordering::Release);
    }
}

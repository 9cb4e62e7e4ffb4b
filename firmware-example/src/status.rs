//! Messages between control tick, bus and background besides the frames themselves.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use dibs_nostd::failsafe::{LinkStatus, State};
use dibs_nostd::wire::{Counters, Event};

/// Counters since the start, written by the bus side, and the controller's state, written by the control tick. Each is
/// exact, but two of them may be of different moments.
#[derive(Debug, Default)]
pub struct BusStatus {
    /// The numbers that the fail-safe machine watches.
    pub link: LinkStatus,
    bytes: AtomicU32,
    published: AtomicU32,
    rejected: AtomicU32,
    safety: AtomicU32,
    /// Epoch and digest of a published frame: [`fingerprint`](Self::fingerprint).
    epoch: AtomicU32,
    digest: AtomicU32,
    is_tree_corrupt: AtomicBool,
}

impl BusStatus {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            link: LinkStatus::new(),
            bytes: AtomicU32::new(0),
            published: AtomicU32::new(0),
            rejected: AtomicU32::new(0),
            safety: AtomicU32::new(0),
            epoch: AtomicU32::new(0),
            digest: AtomicU32::new(0),
            is_tree_corrupt: AtomicBool::new(false),
        }
    }

    /// Bytes that came over the bus; wraps.
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

    /// The controller's state as the wire protocol's status has it; 0 before the first tick.
    #[must_use]
    pub fn safety(&self) -> u8 {
        self.safety.load(Ordering::Relaxed) as u8
    }

    /// Epoch of the frame last read in full, and the CRC-32 of its positions in memory; epoch 0 while there is none.
    #[must_use]
    pub fn fingerprint(&self) -> (u32, u32) {
        let epoch = self.epoch.load(Ordering::Acquire);
        let digest = self.digest.load(Ordering::Acquire);
        let is_one = epoch == self.epoch.load(Ordering::Relaxed);
        if is_one { (epoch, digest) } else { (0, 0) }
    }

    /// Whether the tree was ever found changed. It is never cleared: flash that read wrong once is not trusted.
    #[must_use]
    pub fn is_tree_corrupt(&self) -> bool {
        self.is_tree_corrupt.load(Ordering::Relaxed)
    }

    pub(crate) fn count_bytes(&self, bytes: u32) {
        self.bytes.store(self.bytes().wrapping_add(bytes), Ordering::Relaxed);
    }

    pub(crate) fn set(&self, counters: &Counters) {
        self.published.store(counters.of(Event::Published), Ordering::Relaxed);
        self.rejected.store(counters.rejected(), Ordering::Relaxed);
    }

    pub(crate) fn set_state(&self, state: State) {
        self.safety.store(state as u32 + 1, Ordering::Relaxed);
    }

    pub(crate) fn set_fingerprint(&self, epoch: u32, digest: u32) {
        self.epoch.store(0, Ordering::Relaxed);
        self.digest.store(digest, Ordering::Release);
        self.epoch.store(epoch, Ordering::Release);
    }

    pub(crate) fn set_tree_corrupt(&self) {
        self.is_tree_corrupt.store(true, Ordering::Relaxed);
    }
}

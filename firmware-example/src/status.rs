//! What the bus side tells the control side besides the frames themselves.

use core::sync::atomic::{AtomicU32, Ordering};

use dibs_nostd::failsafe::LinkStatus;

/// Counters since start, written by the bus interrupt and read by anybody. Each is exact; together
/// they may be of two moments.
#[derive(Debug, Default)]
pub struct BusStatus {
    /// What the fail-safe machine watches.
    pub link: LinkStatus,
    packets: AtomicU32,
    published: AtomicU32,
    rejected: AtomicU32,
}

impl BusStatus {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            link: LinkStatus::new(),
            packets: AtomicU32::new(0),
            published: AtomicU32::new(0),
            rejected: AtomicU32::new(0),
        }
    }

    /// Packets that came, good and bad.
    #[must_use]
    pub fn packets(&self) -> u32 {
        self.packets.load(Ordering::Relaxed)
    }

    /// Frames published.
    #[must_use]
    pub fn published(&self) -> u32 {
        self.published.load(Ordering::Relaxed)
    }

    /// Packets rejected, for any cause, and frames with them.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        self.rejected.load(Ordering::Relaxed)
    }

    pub(crate) fn set(&self, packets: u32, published: u32, rejected: u32) {
        self.packets.store(packets, Ordering::Relaxed);
        self.published.store(published, Ordering::Relaxed);
        self.rejected.store(rejected, Ordering::Relaxed);
    }
}

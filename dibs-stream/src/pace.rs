//! Spreads a frame's packets over time.

use std::thread;
use std::time::{Duration, Instant};

/// Gaps that are skipped after a pause that took longer than asked. Then the late packet, this many more and the one
/// that is due are sent at once: fewer than a small receiver's buffer holds.
const CATCH_UP: u32 = 2;

/// Spreads the packets of a frame over a time, for [`Sender::transmit_paced`](super::Sender::transmit_paced), because a
/// receiver with a small buffer loses the end of a burst.
///
/// The packets are evenly spaced. After a pause that takes longer than asked the next packets catch up, but no more
/// than four packets are sent at once.
///
/// ```
/// use dibs_stream::Pace;
/// use std::time::{Duration, Instant};
///
/// let start = Instant::now();
/// let mut pace = Pace::new(start, Duration::from_millis(10), 5);
/// let pauses = [0, 1, 4].map(|ms| pace.pause(start + Duration::from_millis(ms)).as_millis());
/// assert_eq!(pauses, [0, 1, 0]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// When the next packet is due.
    due: Instant,
    /// Time between two packets.
    gap: Duration,
}

impl Pace {
    /// Spreads `packets` packets from `start` on; the last one is due one gap before the end of `time`.
    #[must_use]
    pub fn new(start: Instant, time: Duration, packets: usize) -> Self {
        let packets = u32::try_from(packets).unwrap_or(u32::MAX).max(1);
        Self { due: start, gap: time / packets }
    }

    /// The pause from `now` until the next packet, which the caller then sends.
    #[must_use]
    pub fn pause(&mut self, now: Instant) -> Duration {
        let pause = self.due.saturating_duration_since(now);
        // After a long delay only the last packets are caught up with.
        let late = now.saturating_duration_since(self.due);
        let given_up = late.saturating_sub(self.gap.saturating_mul(CATCH_UP));
        self.due = self.due.checked_add(given_up.saturating_add(self.gap)).unwrap_or(self.due);
        pause
    }

    /// Waits until the next packet is due.
    pub fn wait(&mut self) {
        let pause = self.pause(Instant::now());
        if !pause.is_zero() {
            thread::sleep(pause);
        }
    }
}

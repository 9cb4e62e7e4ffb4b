//! Asking the receiver who it is.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

/// Between two hellos with one nonce.
const INTERVAL: Duration = Duration::from_millis(50);

/// A question that waits for its answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Greeting {
    /// The number that the answer repeats: random, and not 0.
    nonce: u32,
    /// When it was last asked.
    sent: Option<Duration>,
}

impl Greeting {
    pub fn new() -> Self {
        // Seeded by the operating system, anew for each.
        let random = RandomState::new().build_hasher().finish() as u32;
        Self { nonce: if random == 0 { 1 } else { random }, sent: None }
    }

    /// Whether a status with this answer was made after the question.
    pub const fn is_answered_by(&self, answer: u32) -> bool {
        self.nonce == answer
    }

    /// The nonce to ask with, if it is time to ask (again).
    pub fn due(&mut self, now: Duration) -> Option<u32> {
        let is_due = self.sent.is_none_or(|sent| now.saturating_sub(sent) >= INTERVAL);
        is_due.then(|| {
            self.sent = Some(now);
            self.nonce
        })
    }
}

//! The hello, which asks the receiver for its challenge.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

use dibs_nostd::wire::StatusAnswer;

/// Time between two hellos with one nonce.
const INTERVAL: Duration = Duration::from_millis(50);

/// A hello that has no answer yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Greeting {
    /// A random number that the answer repeats.
    nonce: u64,
    /// Time of the last hello.
    sent: Option<Duration>,
}

impl Greeting {
    pub fn new() -> Self {
        // The operating system seeds each `RandomState` anew.
        Self { nonce: RandomState::new().build_hasher().finish(), sent: None }
    }

    /// Whether this answers the hello.
    pub const fn is_answered_by(&self, answer: &StatusAnswer) -> bool {
        self.nonce == answer.nonce
    }

    /// The nonce to send, if a hello is due.
    pub fn due(&mut self, now: Duration) -> Option<u64> {
        let is_due = self.sent.is_none_or(|sent| now.saturating_sub(sent) >= INTERVAL);
        is_due.then(|| {
            self.sent = Some(now);
            self.nonce
        })
    }
}

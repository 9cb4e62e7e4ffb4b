//! Why a receiver does not want a sender's frames, and when to ask it again.

use std::time::Duration;

use dibs_nostd::SurfaceFacts;

/// From one question to the next, while an objection stands.
const ASK_AGAIN: Duration = Duration::from_secs(1);

/// Why a receiver does not want a sender's frames. It stands until an answer shows that it is over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Objection {
    pub cause: Cause,
    /// Not an error before this time: the right receiver may still answer.
    pub holds_from: Duration,
    /// Time of the last question.
    asked: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Another sender has published, with this session.
    Superseded { session: u32 },
    /// A surface with this mesh id and these facts.
    OtherSurface { mesh_id: u32, facts: SurfaceFacts },
}

impl Objection {
    pub const fn new(cause: Cause, now: Duration, holds_from: Duration) -> Self {
        Self { cause, holds_from, asked: now }
    }

    /// Whether to ask the receiver again now.
    pub fn is_due(&mut self, now: Duration) -> bool {
        let is_due = now.saturating_sub(self.asked) >= ASK_AGAIN;
        if is_due {
            self.asked = now;
        }
        is_due
    }
}

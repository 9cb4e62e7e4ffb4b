//! Why a receiver refuses a sender's frames, and when to ask it again.

use std::time::Duration;

use dibs_nostd::SurfaceFacts;

/// Time between two hellos while an objection holds.
const ASK_AGAIN: Duration = Duration::from_secs(1);

/// Why a receiver refuses a sender's frames. It holds until an answer shows that the cause is gone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Objection {
    pub cause: Cause,
    /// Reported as an error only from this time on: the right receiver may still answer.
    pub holds_from: Duration,
    /// Time of the last hello.
    asked: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Another sender has published a frame, with this session.
    Superseded { session: u32 },
    /// The receiver has a surface with this mesh id and these facts.
    OtherSurface { mesh_id: u32, facts: SurfaceFacts },
}

impl Objection {
    pub const fn new(cause: Cause, now: Duration, holds_from: Duration) -> Self {
        Self { cause, holds_from, asked: now }
    }

    /// Whether it is time to ask the receiver again.
    pub fn is_due(&mut self, now: Duration) -> bool {
        let is_due = now.saturating_sub(self.asked) >= ASK_AGAIN;
        if is_due {
            self.asked = now;
        }
        is_due
    }
}

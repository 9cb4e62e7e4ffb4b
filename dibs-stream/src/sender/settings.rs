//! A sender's settings.

use std::time::{Duration, SystemTime};

/// The settings of a [`Sender`](super::Sender).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Sends 6 bytes a vertex instead of 12, quantised in a box that is fitted to each frame.
    pub quantised: bool,
    /// Sends only the vertices that moved by more than this, in mm. With quantised positions the box is made coarser,
    /// so that its stated error covers the vertices left out. It then spans 73 m for each mm of tolerance, and the
    /// receiver must allow coordinates that large. Float positions state no error: only vertices that did not move at
    /// all are left out.
    pub partial: Option<f32>,
    /// With partial frames, the largest number of frames from one whole frame to the next. After a loss a receiver that
    /// cannot send a request waits for it.
    pub whole_every: u32,
    /// Time between two heartbeats; `None` sends none.
    pub heartbeat: Option<Duration>,
    /// Time that a whole frame may take to be acknowledged; until then requests for another one are ignored.
    pub patience: Duration,
    /// Session number of this sender. A receiver ignores packets of earlier sessions, whose numbers are smaller, so a
    /// program that restarts needs a larger one. By default the time in tenths of a second, which wraps after 13 years.
    /// If the number is taken when the sender starts, it uses the next one.
    pub session: u32,
}

impl Default for Settings {
    fn default() -> Self {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        Self {
            quantised: true,
            partial: None,
            whole_every: 250,
            heartbeat: Some(Duration::from_millis(100)),
            patience: Duration::from_millis(500),
            session: (now.as_millis() / 100) as u32,
        }
    }
}

//! How a sender sends.

use std::time::{Duration, SystemTime};

/// How a [`Sender`](super::Sender) sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// 6 bytes a vertex instead of 12, in a box that is fitted to each frame.
    pub quantised: bool,
    /// Sends only the vertices that moved by more than this, in mm. With quantised positions the box
    /// is as coarse as that, so that the error that it states covers what was not sent; it then
    /// reaches 73 m a mm of tolerance, and the receiver must allow coordinates that large. With float
    /// positions there is no error to state: whatever the tolerance, only vertices that did not move
    /// at all are left out.
    pub partial: Option<f32>,
    /// With partial frames: at least every this many frames a whole one. What a receiver that cannot
    /// answer needs after a loss.
    pub whole_every: u32,
    /// Between two heartbeats; `None` sends none.
    pub heartbeat: Option<Duration>,
    /// How long a whole frame may be on its way: a status that asks for one before it arrives is not
    /// heeded.
    pub patience: Duration,
    /// Number of this run: later than that of every run before, which the receiver remembers. By
    /// default the time in tenths of a second, which wraps after 13 years. A sender that finds the number
    /// taken when it starts takes one more.
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

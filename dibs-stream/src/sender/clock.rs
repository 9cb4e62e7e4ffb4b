//! The sender's clock.

use std::time::{Duration, Instant};

/// The source of a sender's time: the system's clock, or another in tests.
pub(super) struct Clock(Box<dyn Fn() -> Duration + Send>);

impl Clock {
    /// A clock that starts at zero now.
    pub fn system() -> Self {
        let start = Instant::now();
        Self(Box::new(move || start.elapsed()))
    }

    pub fn of(now: impl Fn() -> Duration + Send + 'static) -> Self {
        Self(Box::new(now))
    }

    pub fn now(&self) -> Duration {
        (self.0)()
    }
}

//! How late a message is, measured by the time in its header.
//!
//! The two clocks need not agree: the delay of the fastest message so far counts as zero, and that of the others is
//! relative to it. So a delay that all messages have is not measured. Because the clocks drift, the fastest message's
//! lead decays, at a rate above that of any quartz: a lasting delay is measured for an hour. A clock that the peer sets
//! back makes its messages old until the peer reconnects.

use std::time::{Duration, Instant};

/// Upper bound on the drift between the two clocks, in seconds a second: ten times that of quartz.
const DRIFT: f64 = 5e-4;

pub struct Delay {
    start: Instant,
    /// The least difference, in seconds, and the time when it was last updated.
    least: Option<(f64, f64)>,
}

impl Delay {
    pub fn new() -> Self {
        Self { start: Instant::now(), least: None }
    }

    /// The delay of a message, from its arrival and the time in its header; zero if the header has no time.
    pub fn of(&mut self, came: Instant, time: f64) -> Duration {
        let now = came.saturating_duration_since(self.start).as_secs_f64();
        if time > 0.0 { self.at(now, time) } else { Duration::ZERO }
    }

    fn at(&mut self, now: f64, time: f64) -> Duration {
        let difference = now - time;
        let risen = self.least.map_or(difference, |(least, at)| least + DRIFT * (now - at));
        let least = risen.min(difference);
        self.least = Some((least, now));
        Duration::try_from_secs_f64(difference - least).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::Delay;

    #[test]
    fn a_message_is_as_late_as_it_is_behind_the_fastest() {
        let mut delay = Delay::new();
        let mut late = |now: f64, time: f64| delay.at(now, time).as_secs_f64();
        // The peer's clock is behind by 1,000 s.
        assert_eq!(late(2000.0, 999.0), 0.0);
        assert_eq!(late(2001.0, 1000.5), 0.0, "faster than the first");
        assert!((late(2002.0, 1000.5) - 1.0).abs() < 1e-3);
        // A clock that loses 100 parts in a million does not make frames ever older.
        let slow = |hour: f64| late(2003.0 + 3600.0 * hour, 1002.5 + 3600.0 * (1.0 - 1e-4) * hour);
        let latest = (0..100).map(f64::from).map(slow).fold(0.0, f64::max);
        assert!(latest < 1e-3, "{latest}");
    }

    /// A lasting delay of two seconds is still measured a quarter of an hour later.
    #[test]
    fn a_delay_that_lasts_is_not_forgotten() {
        let mut delay = Delay::new();
        let mut late = |now: f64, behind: f64| delay.at(now, now - behind).as_secs_f64();
        assert_eq!(late(0.0, 0.005), 0.0);
        let latest = (1..900).map(f64::from).map(|now| late(now, 2.005));
        assert!(latest.fold(2.0, f64::min) > 1.5);
    }
}

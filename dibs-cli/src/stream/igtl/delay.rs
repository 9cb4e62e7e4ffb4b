//! How late a message is, by the time in its header.
//!
//! The peer's clock may show any time. The least difference to this computer's clock of the last minute counts as none, so
//! that clocks which run apart do not make frames old; what every message takes is not seen.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Half of the time over which the least difference counts, in seconds.
const HALF: f64 = 30.0;

pub struct Delay {
    /// The least differences of this half and of the one before, in seconds.
    least: [f64; 2],
    /// When this half began, by this computer's clock.
    began: f64,
}

impl Delay {
    pub const fn new() -> Self {
        Self { least: [f64::INFINITY; 2], began: 0.0 }
    }

    /// Time on the way of a message that came now, beyond that of the fastest; zero where it has no time.
    pub fn of(&mut self, time: f64) -> Duration {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        if time > 0.0 { self.at(now.as_secs_f64(), time) } else { Duration::ZERO }
    }

    fn at(&mut self, now: f64, time: f64) -> Duration {
        let difference = now - time;
        if !(0.0..HALF).contains(&(now - self.began)) {
            (self.least, self.began) = ([f64::INFINITY, self.least[0]], now);
        }
        self.least[0] = self.least[0].min(difference);
        let beyond = difference - self.least[0].min(self.least[1]);
        Duration::try_from_secs_f64(beyond).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::Delay;

    #[test]
    fn a_message_is_as_late_as_it_is_behind_the_fastest() {
        let mut delay = Delay::new();
        let mut late = |now: f64, time: f64| delay.at(now, time).as_secs_f64();
        // The peer's clock is 1,000 s behind.
        assert_eq!(late(2000.0, 999.0), 0.0);
        assert_eq!(late(2001.0, 1000.5), 0.0, "faster than the first");
        assert_eq!(late(2002.0, 1000.5), 1.0);
        // A clock that loses 0.1 s in 25 s does not make frames older and older.
        let slow = |step: f64| late(2003.0 + 25.0 * step, 1002.5 + 24.9 * step);
        let latest = (0..100).map(f64::from).map(slow).fold(0.0, f64::max);
        assert!((0.1..0.4).contains(&latest), "{latest}");
    }
}

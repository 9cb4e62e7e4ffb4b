//! The age of a frame's positions and of its pose.

use std::time::{Duration, Instant};

/// Positions or a pose as a source sent them.
pub struct Part<T> {
    pub value: T,
    /// The time that the source states of the measurement; 0 where it states none.
    pub time: f64,
    pub came: Instant,
    /// Its age when it came.
    pub delay: Duration,
}

impl<T: PartialEq> Part<T> {
    /// Takes the next part in the place of the last one, and returns it. A part that repeats the last one is as old as that,
    /// unless it has a time of its own: so an image that is sent again under the same time grows old, also beside a pose that
    /// moves, and an organ at rest that is measured anew does not. A source must state there when it measured: one that
    /// states when it sends hides that it is frozen.
    pub fn replace(last: &mut Option<Self>, next: Self) -> &Self {
        let repeats = |last: &Self| {
            last.value == next.value
                && (next.time <= 0.0 || next.time.total_cmp(&last.time).is_eq())
        };
        match last.take() {
            Some(same) if repeats(&same) => last.insert(same),
            _ => last.insert(next),
        }
    }

    /// Time since the measurement.
    pub fn age(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.came) + self.delay
    }
}

#[cfg(test)]
mod tests {
    use super::Part;
    use std::time::{Duration, Instant};

    #[test]
    fn a_repeated_part_is_new_by_its_time_alone() {
        let start = Instant::now();
        let mut last = None;
        let mut age = |ms: u64, value: u32, time: f64| {
            let (came, delay) = (start + Duration::from_millis(ms), Duration::from_millis(5));
            Part::replace(&mut last, Part { value, time, came, delay });
            last.as_ref().map(|part| part.age(came).as_millis())
        };
        assert_eq!(age(0, 1, 0.0), Some(5));
        assert_eq!(age(100, 1, 0.0), Some(105), "no time says that it was measured anew");
        assert_eq!(age(200, 2, 0.0), Some(5), "another one");
        assert_eq!(age(300, 2, 7.0), Some(5), "measured at 7");
        assert_eq!(age(400, 2, 7.0), Some(105), "the same message once more");
        assert_eq!(age(500, 2, 0.0), Some(205), "without a time");
        assert_eq!(age(600, 2, 7.1), Some(5), "measured anew");
        assert_eq!(age(700, 3, 7.1), Some(5), "another one");
        assert_eq!(age(800, 3, 1.0), Some(5), "by another clock, after a new connection");
    }
}

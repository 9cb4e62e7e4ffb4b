//! The rate of a live source, its gaps, and its latency: from a frame's last byte until the frame is sent.

use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Number of bins, each of 0.1 ms.
const BINS: usize = 1000;

pub struct Timing {
    came: Option<(Instant, Instant)>,
    longest_gap: Duration,
    frames: u64,
    /// Number of frames by latency; the last bin includes all longer ones.
    bins: Vec<u64>,
    longest: Duration,
}

impl Timing {
    pub fn new() -> Self {
        let (longest_gap, longest) = Default::default();
        Self { came: None, longest_gap, frames: 0, bins: vec![0; BINS], longest }
    }

    /// Counts a frame that was sent.
    pub fn count(&mut self, came: Instant) {
        let latency = came.elapsed();
        let (first, last) = self.came.unwrap_or((came, came));
        self.came = Some((first, came));
        self.longest_gap = self.longest_gap.max(came - last);
        self.longest = self.longest.max(latency);
        self.frames += 1;
        let bin = (latency.as_micros() / 100).min(BINS as u128 - 1);
        self.bins[bin as usize] += 1;
    }

    /// Counts the silence after the last frame as a gap.
    pub fn end(&mut self) {
        let silence = self.came.map_or(Duration::ZERO, |(_, last)| last.elapsed());
        self.longest_gap = self.longest_gap.max(silence);
    }

    /// Frames a second; 0 for fewer than two.
    fn rate(&self) -> f64 {
        let Some((first, last)) = self.came.filter(|_| self.frames > 1) else { return 0.0 };
        (self.frames - 1) as f64 / (last - first).as_secs_f64().max(1e-9)
    }

    /// The latency that this fraction of the frames does not exceed, in milliseconds.
    fn latency(&self, part: f64) -> f64 {
        let mut left = (part * self.frames as f64).ceil() as u64;
        let at = self.bins.iter().position(|&frames| {
            left = left.saturating_sub(frames);
            left == 0
        });
        let longest = self.longest.as_secs_f64() * 1000.0;
        let above = at.filter(|&bin| bin + 1 < BINS).map(|bin| (bin + 1) as f64 / 10.0);
        above.map_or(longest, |above| above.min(longest))
    }

    pub fn json(&self) -> Value {
        json!({
            "rate_hz": self.rate(),
            "longest_gap_ms": self.longest_gap.as_secs_f64() * 1000.0,
            "latency_ms": {
                "p50": self.latency(0.5),
                "p99": self.latency(0.99),
                "longest": self.longest.as_secs_f64() * 1000.0,
            },
        })
    }

    pub fn text(&self) -> String {
        format!(
            "{:.1} frames a second, the longest gap {} ms; {:.1} ms from a frame until it is sent, for 99 % at most {:.1}",
            self.rate(),
            self.longest_gap.as_millis(),
            self.latency(0.5),
            self.latency(0.99)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Timing;
    use std::time::{Duration, Instant};

    #[test]
    fn rates_gaps_and_latencies() {
        let mut timing = Timing::new();
        assert_eq!((timing.rate(), timing.latency(0.99)), (0.0, 0.0));
        let start = Instant::now().checked_sub(Duration::from_secs(3)).expect("an early time");
        // One frame of four is late, by more than all bins cover.
        for ms in [0, 100, 900, 3000] {
            timing.count(start + Duration::from_millis(ms));
        }
        assert!((timing.rate() - 1.0).abs() < 1e-9, "{}", timing.rate());
        timing.end();
        assert_eq!(timing.longest_gap, Duration::from_millis(2100));
        let [half, most] = [0.25, 1.0].map(|part| timing.latency(part));
        assert!(half < 100.0 && most >= 3000.0, "{half} {most}");
        let mut timing = Timing::new();
        timing.count(start);
        timing.end();
        assert!(timing.longest_gap >= Duration::from_secs(3), "silent after its only frame");
    }
}

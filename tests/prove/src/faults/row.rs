//! One row of the fault matrix.

use std::collections::BTreeMap;
use std::fmt;

use dibs_stream::faults::Fault;
use serde::Serialize;

/// The outcomes of the faults of one kind.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    pub fault: &'static str,
    pub injected: u64,
    /// Faults after which something was rejected, abandoned or ignored as a duplicate, or the frame was not published.
    pub detected: u64,
    /// Number of faults without a noticed effect, where the frame was published as sent.
    pub harmless: u64,
    /// Number of published surfaces that were not sent.
    pub published_wrong: u64,
    /// Count of each cause.
    pub rejected: BTreeMap<&'static str, u64>,
    /// Mean number of undisturbed frames until one was published; 0 if the disturbed one was.
    pub recovered_frames_mean: f64,
    pub recovered_frames_max: u32,
    /// Packets from the fault to the next publication.
    pub recovered_packets_mean: f64,
    pub recovered_packets_max: u32,
    /// Number of faults after which no frame was published any more.
    pub not_recovered: u64,
    #[serde(skip)]
    pub(super) sums: [u64; 2],
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let causes: Vec<_> =
            self.rejected.iter().map(|(cause, n)| format!("{cause} {n}")).collect();
        write!(
            f,
            "{:<20} {:>7} injected, {:>7} detected, {:>6} harmless, {} published wrong, recovered \
             within {:.2} frames ({} at most), {:.1} packets ({} at most); {}",
            self.fault,
            self.injected,
            self.detected,
            self.harmless,
            self.published_wrong,
            self.recovered_frames_mean,
            self.recovered_frames_max,
            self.recovered_packets_mean,
            self.recovered_packets_max,
            causes.join(", ")
        )
    }
}

impl Row {
    /// The sum of both counts.
    pub fn plus(mut self, other: Self) -> Self {
        self.injected += other.injected;
        self.detected += other.detected;
        self.harmless += other.harmless;
        self.published_wrong += other.published_wrong;
        self.not_recovered += other.not_recovered;
        self.recovered_frames_max = self.recovered_frames_max.max(other.recovered_frames_max);
        self.recovered_packets_max = self.recovered_packets_max.max(other.recovered_packets_max);
        self.sums = [self.sums[0] + other.sums[0], self.sums[1] + other.sums[1]];
        for (cause, n) in other.rejected {
            *self.rejected.entry(cause).or_default() += n;
        }
        self
    }

    /// The row of a fault, with its means.
    pub fn finished(mut self, fault: Fault) -> Self {
        self.fault = fault.name();
        let [frames, packets] = self.sums.map(|sum| sum as f64 / self.injected.max(1) as f64);
        (self.recovered_frames_mean, self.recovered_packets_mean) = (frames, packets);
        self
    }
}

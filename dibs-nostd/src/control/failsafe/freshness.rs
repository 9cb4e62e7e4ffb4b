//! Limits on faults that the age alone does not show: delay on the way, a source that stands still, forgeries.

use super::{Limits, Link, State, Watch};
use crate::unavailable::Unavailable;

/// The limits, off by default.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Freshness {
    transit: Watch,
    source_age: Watch,
    forgeries: Watch<u32>,
}

impl Freshness {
    pub const OFF: Self =
        Self { transit: Watch::OFF, source_age: Watch::OFF, forgeries: Watch::OFF };

    /// The level that each input requires, and its cause.
    pub fn levels(&self, link: &Link) -> [(State, Unavailable); 3] {
        let Link { transit, source_age, forgeries, .. } = *link;
        [
            (self.transit.level(transit), Unavailable::Delayed { transit }),
            (self.source_age.level(source_age), Unavailable::SourceStale { age: source_age }),
            (self.forgeries.level(forgeries), Unavailable::Forgeries { count: forgeries }),
        ]
    }
}

impl Limits {
    /// Limits on the time that the published frame was on its way, measured from the status that it echoes: no clock of
    /// the sender is needed. Normally it is the time between two statuses plus the way there and back. A frame without
    /// an echo is beyond every limit.
    #[must_use]
    pub const fn transit(mut self, watch: Watch) -> Self {
        self.freshness.transit = watch;
        self
    }

    /// Limits on the age of the published frame when it was sent: a source that stands still while its
    /// sender lives.
    #[must_use]
    pub const fn source_age(mut self, watch: Watch) -> Self {
        self.freshness.source_age = watch;
        self
    }

    /// Limits on the forged packets since the last frame was published.
    #[must_use]
    pub const fn forgeries(mut self, watch: Watch<u32>) -> Self {
        self.freshness.forgeries = watch;
        self
    }
}

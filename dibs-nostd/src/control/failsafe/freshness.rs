//! Limits on faults that the age alone does not show: delay on the way, a source that stands still, forgeries.

use super::{LimitError, Limits, Link, State, Watch};
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

    /// Limits on forged packets, of which [`BusHealth::FORGERIES_A_SECOND`](crate::BusHealth::FORGERIES_A_SECOND) are
    /// forgotten each second, whatever is published.
    ///
    /// # Errors
    /// [`LimitError::Untrippable`] if the second limit is [`Link::MOST_FORGERIES`] or more, which no link reports more
    /// of. [`Watch::OFF`] is allowed.
    pub const fn forgeries(mut self, watch: Watch<u32>) -> Result<Self, LimitError> {
        if watch.safe() >= Link::MOST_FORGERIES && watch.safe() != Watch::<u32>::OFF.safe() {
            return Err(LimitError::Untrippable { safe: watch.safe() });
        }
        self.freshness.forgeries = watch;
        Ok(self)
    }
}

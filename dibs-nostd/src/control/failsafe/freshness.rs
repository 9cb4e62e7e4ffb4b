//! Limits on faults that the age alone does not show: transit delay, a source that stopped, forgeries.

use super::{LimitError, Limits, Link, State, ThresholdPair};
use crate::surface::Millis;
use crate::unavailable::Unavailable;

/// The limits. By default transit has the limits on age, and the others are off.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub(super) struct Freshness {
    transit: Transit,
    source_age: ThresholdPair,
    forgeries: ThresholdPair<u32>,
}

impl Freshness {
    pub const OFF: Self = Self {
        transit: Transit::AsAge,
        source_age: ThresholdPair::OFF,
        forgeries: ThresholdPair::OFF,
    };

    /// The transit time that counts for the margin.
    pub const fn transit(&self, link: &Link) -> Millis {
        match self.transit {
            Transit::LeftOut => Millis(0),
            Transit::AsAge | Transit::Watched(_) => link.transit,
        }
    }

    /// The level that each input requires, and its cause.
    pub fn levels(&self, link: &Link, age: ThresholdPair) -> [(State, Unavailable); 3] {
        let Link { source_age, forgeries, .. } = *link;
        let transit = self.transit(link);
        let pair = match self.transit {
            Transit::Watched(pair) => pair,
            Transit::AsAge | Transit::LeftOut => age,
        };
        [
            (pair.level(transit), Unavailable::Delayed { transit }),
            (self.source_age.level(source_age), Unavailable::SourceStale { age: source_age }),
            (self.forgeries.level(forgeries), Unavailable::Forgeries { count: forgeries }),
        ]
    }
}

/// How the transit time is used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
enum Transit {
    /// In the margin, with the limits on age.
    AsAge,
    /// In the margin, with limits of its own.
    Watched(ThresholdPair),
    /// In neither the margin nor the limits.
    LeftOut,
}

/// A frame that was older when sent is not published, because its packets cannot state the age.
const OLDEST: Millis = Millis(u16::MAX as u32 - 1);

impl Limits {
    /// Limits on the transit time of the published frame, measured from the status that it echoes: no clock of the
    /// sender is needed. Normally it is the time between two statuses plus the latency in both directions. A frame
    /// without an echo is beyond every limit. By default these are the limits on age. The margin includes this time.
    #[must_use]
    pub const fn transit(mut self, pair: ThresholdPair) -> Self {
        self.freshness.transit = Transit::Watched(pair);
        self
    }

    /// Leaves transit out of the margin and the limits: for a bus whose delay is known to be short by other means. A
    /// delay is then not detected, and no margin covers it.
    #[must_use]
    pub const fn without_transit(mut self) -> Self {
        self.freshness.transit = Transit::LeftOut;
        self
    }

    /// Limits on the age of the published frame when it was sent: they detect a source that stopped while its sender is
    /// alive.
    ///
    /// # Errors
    /// [`LimitError::Untrippable`] if the safe limit is 65,534 ms or more: no frame older than that is published.
    pub const fn source_age(mut self, pair: ThresholdPair) -> Result<Self, LimitError> {
        let safe = pair.safe();
        if safe.0 >= OLDEST.0 && safe.0 != Millis::MAX.0 {
            return Err(LimitError::Untrippable { safe: safe.0 });
        }
        self.freshness.source_age = pair;
        Ok(self)
    }

    /// Limits on forged packets, of which [`BusHealth::FORGERIES_A_SECOND`](crate::BusHealth::FORGERIES_A_SECOND) are
    /// subtracted each second, independent of publications.
    ///
    /// # Errors
    /// [`LimitError::Untrippable`] if the second limit is at least [`Link::MOST_FORGERIES`], the largest count that a
    /// link reports. [`ThresholdPair::OFF`] is allowed.
    pub const fn forgeries(mut self, pair: ThresholdPair<u32>) -> Result<Self, LimitError> {
        if pair.safe() >= Link::MOST_FORGERIES && pair.safe() != ThresholdPair::<u32>::OFF.safe() {
            return Err(LimitError::Untrippable { safe: pair.safe() });
        }
        self.freshness.forgeries = pair;
        Ok(self)
    }
}

//! The control tick's view of the bus's health.

use crate::surface::Millis;

/// The health of the bus at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Link {
    /// Time since the last good packet; [`Millis::MAX`] before the first.
    pub silence: Millis,
    /// Time since the sender was last known to be alive, by its heartbeats; [`Millis::MAX`] before the first.
    pub heartbeat: Millis,
    /// Frames that failed since the last publication: [`BusHealth::rejections`](crate::BusHealth::rejections).
    pub rejections: u32,
    /// Forged packets, less 10 for each second: [`BusHealth::forgeries`](crate::BusHealth::forgeries).
    pub forgeries: u32,
    /// Upper bound on the transit time of the published frame; [`Millis::MAX`] if unknown.
    pub transit: Millis,
    /// Age of the published frame when it was sent; [`Millis::MAX`] before the first.
    pub source_age: Millis,
}

impl Link {
    /// No fault.
    pub const CLEAR: Self = Self {
        silence: Millis(0),
        heartbeat: Millis(0),
        rejections: 0,
        forgeries: 0,
        transit: Millis(0),
        source_age: Millis(0),
    };

    /// The largest number of forgeries that is reported.
    pub const MOST_FORGERIES: u32 = 1_000;
}

//! The control tick's view of the bus's health.

/// The health of the bus at one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Link {
    /// Time since the last good packet; `u32::MAX` before the first.
    pub silence: u32,
    /// Time since the last heartbeat; `u32::MAX` before the first.
    pub heartbeat: u32,
    /// Frames refused or damaged since the last publication: [`BusHealth::rejections`](crate::BusHealth::rejections).
    pub rejections: u32,
    /// Forged packets since then.
    pub forgeries: u32,
    /// Time that the published frame was on its way, at most; `u32::MAX` where it is unknown.
    pub transit: u32,
    /// Age of the published frame when it was sent; `u32::MAX` before the first.
    pub source_age: u32,
}

impl Link {
    /// No fault.
    pub const CLEAR: Self =
        Self { silence: 0, heartbeat: 0, rejections: 0, forgeries: 0, transit: 0, source_age: 0 };
}

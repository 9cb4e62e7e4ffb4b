//! The answer of a tick.

// Requirement: C-08

use glam::Vec3;

use crate::constraint::{ConstraintForce, ForbiddenRegion, Guidance};
use crate::failsafe::{Link, Verdict};
use crate::{ContactIter, Contacts, FrameAge, Millis, Proximity, TrackerAnswer, Unavailable};

/// The answer of a tick: the input of a constraint, and how it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Answer {
    /// The closest pair for a constraint, or why there is none. Its accuracy covers the errors of the frame and of the
    /// extrapolation, and the tissue's motion while the surface lags. If its side is unknown, it is the last pair with
    /// a known side.
    pub closest: Result<Proximity, Unavailable>,
    /// Velocity of the tool's point of the pair relative to the surface's (mm/s); without a pair that of the axis'
    /// middle. Zero at the first tick, NaN without a tool.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
    /// The trust in the surface.
    pub trust: Verdict,
    /// The health of the bus.
    pub link: Link,
    /// The surface that was searched; `None` before the first frame.
    pub searched: Option<SearchedSurface>,
    /// The answer on that surface, even if the surface is not trusted.
    pub tracked: Result<TrackerAnswer, Unavailable>,
}

/// The surface that a tick searched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SearchedSurface {
    /// The last published frame, and its age.
    pub frame: FrameAge,
    /// Epoch of the previous frame; the last frame's own if the surface is held.
    pub before: u32,
    /// The surface's time in steps: 0 is the previous frame, 1 the last frame, 3 the end of the extrapolation.
    pub t: f32,
    /// Error of each position (mm), including that of the extrapolation.
    pub position_error: f32,
    /// The distance (mm) of the last frames from their extrapolation; `None` if the surface is held.
    pub residual: Option<f32>,
    /// The surface's velocity at the pair (mm/s): from one frame to the next, zero if the surface is held.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
    /// How far the surface is behind the present, beyond what its error covers.
    pub lag: Option<Millis>,
}

impl Answer {
    /// The force of a wall.
    #[must_use]
    pub fn force(&self, wall: &ForbiddenRegion) -> ConstraintForce {
        wall.force(&self.closest, self.velocity)
    }

    /// The contacts of the list filled by [`Guard::contacts`](super::Guard::contacts) in this tick, for a
    /// [`Proxy`](crate::constraint::Proxy) with this margin (mm), or why there are none: see [`Contacts::within`].
    ///
    /// # Errors
    /// The error of the [closest](Self::closest) pair, and those of [`Contacts::within`].
    pub fn contacts<'c, const N: usize, const NEAR: usize>(
        &self,
        contacts: &'c Contacts<N, NEAR>,
        margin: f32,
    ) -> Result<ContactIter<'c>, Unavailable> {
        self.closest?;
        contacts.within(margin)
    }

    /// The force that leads along the surface.
    #[must_use]
    pub fn guide(&self, guidance: &Guidance) -> ConstraintForce {
        guidance.force(&self.closest, self.velocity)
    }
}

//! The answer of a tick.

// Requirement: C-08

use glam::Vec3;

use crate::constraint::{ConstraintForce, ForbiddenRegion, Guidance};
use crate::failsafe::{Link, Verdict};
use crate::{ContactIter, Contacts, FrameAge, Millis, Proximity, TrackerAnswer, Unavailable};

/// The answer of a tick: what a constraint may act on, and how it came about.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Answer {
    /// The closest pair to act on, or why there is none. Its accuracy covers the frame's error, the extrapolation's,
    /// and the tissue's motion where the surface lags; where its side is not known it is the last one whose side was.
    pub closest: Result<Proximity, Unavailable>,
    /// Velocity of the tool's point of the pair relative to the surface's (mm/s); without a pair that of the middle of
    /// the axis. Zero at the first tick, and not a number without a tool.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
    /// The trust in the surface.
    pub trust: Verdict,
    /// The health of the bus.
    pub link: Link,
    /// The surface that was searched; `None` before the first.
    pub searched: Option<Searched>,
    /// The answer on that surface, trusted or not.
    pub tracked: Result<TrackerAnswer, Unavailable>,
}

/// The surface that a tick searched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Searched {
    /// The frame published last, and its age.
    pub frame: FrameAge,
    /// Epoch of the frame before; the same for a surface that is held.
    pub before: u32,
    /// Its time in steps: 0 is the frame before, 1 the last frame, 3 the end of the extrapolation.
    pub t: f32,
    /// Error of each position (mm), that of the extrapolation included.
    pub position_error: f32,
    /// The distance (mm) of the last frames from their extrapolation; `None` for a surface that is held.
    pub residual: Option<f32>,
    /// Its velocity at the pair (mm/s): from one frame to the next, zero for a surface that is held.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
    /// The time by which it is behind the present, as far as its error does not cover it.
    pub lag: Option<Millis>,
}

impl Answer {
    /// The force of a wall.
    #[must_use]
    pub fn force(&self, wall: &ForbiddenRegion) -> ConstraintForce {
        wall.force(&self.closest, self.velocity)
    }

    /// Of the list that [`Guard::contacts`](super::Guard::contacts) filled in this tick, the contacts that a
    /// [`Proxy`](crate::constraint::Proxy) with this margin (mm) may act on, or why there are none: see
    /// [`Contacts::within`].
    ///
    /// # Errors
    /// That of the [closest](Self::closest) pair, and those of [`Contacts::within`].
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

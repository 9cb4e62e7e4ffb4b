//! The newest surface with its age, for a control tick.

// Requirement: B-05

use super::Millis;
use crate::unavailable::Unavailable;

/// The last published frame and its age, for surfaces of vertices and of modes.
///
/// A frame received up to 16 ms ahead of the clock has age 0: another core may have stamped it. A frame farther ahead
/// is old. No frame grows younger, if its age is read at least once in 2^31 ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct FrameAge {
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// Arrival of its first packet on the receiver's clock, less its age at sending; wraps.
    pub received: Millis,
    /// Time since then.
    pub age: Millis,
}

/// The last published surface, if any, from [`FrameReader::latest`](crate::FrameReader::latest) or
/// [`ModalReader::latest`](crate::modes::ModalReader::latest).
#[derive(Debug)]
#[must_use]
pub struct LatestSurface<S> {
    surface: Option<(S, FrameAge)>,
}

impl<S> LatestSurface<S> {
    pub(crate) const fn new(surface: Option<(S, FrameAge)>) -> Self {
        Self { surface }
    }

    #[cfg(feature = "modes")]
    pub(crate) fn map<T>(self, of: impl FnOnce(S) -> T) -> LatestSurface<T> {
        LatestSurface { surface: self.surface.map(|(surface, frame)| (of(surface), frame)) }
    }

    /// The surface, if it is at most `limit` old. For a source that may lose a frame, use two of its periods plus the
    /// transit time: 80 ms at 30 Hz. The next frame arrives at the earliest one period after this one.
    ///
    /// # Errors
    /// [`Unavailable::NoSurface`] before the first publication, [`Unavailable::Stale`] with its age.
    #[inline]
    pub fn within(self, limit: Millis) -> Result<S, Unavailable> {
        match self.surface {
            None => Err(Unavailable::NoSurface),
            Some((_, FrameAge { age, .. })) if age > limit => Err(Unavailable::Stale { age }),
            Some((surface, _)) => Ok(surface),
        }
    }

    /// The surface at any age: for a controller whose [`FailSafe`](crate::failsafe::FailSafe) machine checks the age.
    ///
    /// # Errors
    /// [`Unavailable::NoSurface`] before the first publication.
    #[inline]
    pub fn of_any_age(self) -> Result<S, Unavailable> {
        self.within(Millis::MAX)
    }

    /// Its frame and age; `None` before the first publication.
    #[must_use]
    pub fn frame(&self) -> Option<FrameAge> {
        self.surface.as_ref().map(|(_, frame)| *frame)
    }
}

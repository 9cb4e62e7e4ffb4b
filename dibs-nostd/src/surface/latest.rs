//! The newest surface with its age: how a control tick asks for it.

use crate::unavailable::Unavailable;

/// Which frame was published last, and how old it is: one notion of age for surfaces of vertices and of modes.
///
/// A frame received up to 16 units ahead of the clock has age 0, another core may have stamped it. One farther ahead
/// is old, and no frame grows younger, whatever the clock does, if its age is asked for at least once in 2^31 units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameAge {
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// When its first packet arrived, on the receiver's clock; wraps.
    pub received: u32,
    /// Time since then, in the clock's unit.
    pub age: u32,
}

/// The surface that was published last, if any was: [`FrameReader::latest`](crate::FrameReader::latest) and
/// [`ModalReader::latest`](crate::modes::ModalReader::latest) give one.
#[derive(Debug)]
#[must_use]
pub struct Latest<S> {
    surface: Option<(S, FrameAge)>,
}

impl<S> Latest<S> {
    pub(crate) const fn new(surface: Option<(S, FrameAge)>) -> Self {
        Self { surface }
    }

    #[cfg(feature = "modes")]
    pub(crate) fn map<T>(self, of: impl FnOnce(S) -> T) -> Latest<T> {
        Latest { surface: self.surface.map(|(surface, frame)| (of(surface), frame)) }
    }

    /// The surface, if it is not older than `limit` (in the clock's unit).
    ///
    /// # Errors
    /// [`Unavailable::NoSurface`] before the first was published, [`Unavailable::Stale`] with its age.
    #[inline]
    pub fn within(self, limit: u32) -> Result<S, Unavailable> {
        match self.surface {
            None => Err(Unavailable::NoSurface),
            Some((_, FrameAge { age, .. })) if age > limit => Err(Unavailable::Stale { age }),
            Some((surface, _)) => Ok(surface),
        }
    }

    /// The surface, whatever its age: for a controller that leaves the age to a
    /// [`FailSafe`](crate::failsafe::FailSafe) machine.
    ///
    /// # Errors
    /// [`Unavailable::NoSurface`] before the first was published.
    #[inline]
    pub fn of_any_age(self) -> Result<S, Unavailable> {
        self.within(u32::MAX)
    }

    /// Which frame it is and how old; `None` before the first was published.
    #[must_use]
    pub fn frame(&self) -> Option<FrameAge> {
        self.surface.as_ref().map(|(_, frame)| *frame)
    }
}

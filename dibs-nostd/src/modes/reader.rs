//! The control tick's end of a bus that carries weights.

use glam::Vec3;

use super::{ModalSurface, Modes, WeightsError};
use crate::surface::{FrameLabel, FrameReader, VertexTable};
use crate::unavailable::Unavailable;

/// Reads published weights as surfaces. The double buffer is [`Frames`](crate::Frames) of `K` rows, of
/// which each holds one weight.
pub struct ModalReader<'f, 'a, const K: usize> {
    frames: FrameReader<'f, K>,
    modes: Modes<'a>,
}

impl<'f, 'a, const K: usize> ModalReader<'f, 'a, K> {
    /// A reader of surfaces of exactly `K` modes.
    ///
    /// # Errors
    /// [`WeightsError::Count`] for another number of modes.
    pub fn new(frames: FrameReader<'f, K>, modes: &Modes<'a>) -> Result<Self, WeightsError> {
        let (expected, found) = (modes.count() as u32, K as u32);
        if expected != found {
            return Err(WeightsError::Count { expected, found });
        }
        Ok(Self { frames, modes: *modes })
    }

    /// The published surface; `None` before the first. O(modes).
    ///
    /// The weights are copied: unlike with [`FrameReader::read`], frames are published meanwhile, for
    /// as long as this one is kept.
    #[inline]
    pub fn read(&mut self) -> Option<ModalFrame<'a, K>> {
        let frame = self.frames.read()?;
        let weights = (0..K as u32).map(|row| frame.position(row).unwrap_or_default().x);
        let surface = ModalSurface::new(&self.modes, weights);
        Some(ModalFrame { surface, label: frame.label() })
    }
}

/// A published modal surface: a [`VertexTable`].
#[derive(Clone, Copy, Debug)]
pub struct ModalFrame<'a, const K: usize> {
    surface: ModalSurface<'a, K>,
    label: FrameLabel,
}

impl<const K: usize> ModalFrame<'_, K> {
    /// What is known of this frame. Its position error is that of the modes, against the motion that
    /// they were fitted to.
    #[must_use]
    pub const fn label(&self) -> FrameLabel {
        self.label
    }

    /// Time since the frame's first packet arrived, in the unit of the receiver's clock. Right over
    /// one wrap of the clock.
    #[must_use]
    pub const fn age(&self, now: u32) -> u32 {
        now.wrapping_sub(self.label.received)
    }

    /// What a constraint has to be told when the frame is older than `limit`.
    ///
    /// # Errors
    /// [`Unavailable::Stale`] with the age.
    pub const fn check_age(&self, now: u32, limit: u32) -> Result<(), Unavailable> {
        let age = self.age(now);
        if age > limit { Err(Unavailable::Stale { age }) } else { Ok(()) }
    }
}

impl<const K: usize> VertexTable for ModalFrame<'_, K> {
    fn len(&self) -> usize {
        self.surface.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.surface.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        Some(self.label.epoch)
    }
}

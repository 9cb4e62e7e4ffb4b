//! The control tick's end of a bus that carries weights.

use glam::Vec3;

use super::{ModalSurface, Modes, WeightsError};
use crate::surface::{FrameGuard, FrameLabel, FrameReader, Latest, MeasuredStretch, VertexTable};

/// Reads published weights as surfaces. The double buffer is [`Frames`](crate::Frames) of `K` rows, with one weight in
/// each.
#[derive(Debug)]
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

    /// The published surface and its age at `now`, on the receiver's clock. O(modes).
    ///
    /// The weights are copied, so frames can be published while this one is kept, unlike with [`FrameReader::latest`].
    #[inline]
    pub fn latest(&mut self, now: u32) -> Latest<ModalFrame<'a, K>> {
        let modes = &self.modes;
        self.frames.latest(now).map(|frame| ModalFrame::new(modes, &frame))
    }

    /// The published surface, without its age; `None` before the first.
    #[inline]
    pub fn read(&mut self) -> Option<ModalFrame<'a, K>> {
        let frame = self.frames.read()?;
        Some(ModalFrame::new(&self.modes, &frame))
    }
}

/// A published modal surface: a [`VertexTable`] that carries a bound on its stretch and its position error.
#[derive(Clone, Copy, Debug)]
pub struct ModalFrame<'a, const K: usize> {
    surface: ModalSurface<'a, K>,
    label: FrameLabel,
}

impl<'a, const K: usize> ModalFrame<'a, K> {
    fn new(modes: &Modes<'a>, frame: &FrameGuard<'_, K>) -> Self {
        let weights = (0..K as u32).map(|row| frame.position(row).unwrap_or_default().x);
        Self { surface: ModalSurface::new(modes, weights), label: frame.label() }
    }

    /// The facts about this frame. Its position error is that of the modes for the motion that they were fitted to.
    #[must_use]
    pub const fn label(&self) -> FrameLabel {
        self.label
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

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.label.stretch
    }

    fn position_error(&self) -> f32 {
        self.label.position_error
    }
}

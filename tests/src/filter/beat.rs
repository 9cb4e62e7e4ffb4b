//! A recorded motion between its frames, at any time.

use dibs_nostd::{Index, Odometer, Step, SurfaceBlend, Tree};
use glam::Vec3;

/// A surface that repeats the frames of a motion.
pub struct Beat<'f> {
    frames: &'f [Vec<Vec3>],
    rate: f32,
    odometer: Odometer,
    /// The last step between frames, and its number.
    step: Option<Step<'f, [Vec3], [Vec3]>>,
    number: usize,
}

/// The surface at a time.
pub struct Moment<'f> {
    /// Its vertices, blended from two frames.
    pub surface: SurfaceBlend<'f, [Vec3], [Vec3]>,
    /// Numbers of the frame before the time and of the one after it.
    pub frames: [usize; 2],
    /// The time since the frame before, as a fraction of the step between the two.
    pub share: f32,
    /// Whether the last time was in another step.
    pub is_next: bool,
}

impl<'f> Beat<'f> {
    /// The rows of a tree's frames, at a rate (1/s).
    #[must_use]
    pub fn new<I: Index>(tree: &Tree<'_, I>, frames: &'f [Vec<Vec3>], rate: f32) -> Self {
        Self { frames, rate, odometer: Odometer::new(tree), step: None, number: 0 }
    }

    /// The surface at this time (s), not before the last one.
    pub fn at(&mut self, time: f32) -> Moment<'f> {
        let time = time * self.rate;
        let (number, share) = (time as usize, time.fract());
        let frames = [number, number + 1].map(|frame| frame % self.frames.len());
        let last = self.step.take().filter(|_| self.number == number);
        let is_next = last.is_none();
        let step = last.unwrap_or_else(|| {
            let [from, to] = frames.map(|frame| self.frames[frame].as_slice());
            self.odometer.step(from, to)
        });
        let surface = step.at(share);
        (self.step, self.number) = (Some(step), number);
        Moment { surface, frames, share, is_next }
    }
}

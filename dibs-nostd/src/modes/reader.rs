//! The control tick's end of a bus for weights.

use super::frame::{WeightStep, Weights};
use super::reach::Reach;
use super::{ModalFrame, Modes, WeightsError};
use crate::surface::{
    FrameGuard, FrameLabel, FrameReader, LatestSurface, Millis, MotionReading, VertexTable,
};

/// Reads published weights as surfaces. The double buffer is [`Frames`](crate::Frames) of `K` rows with one weight
/// each.
///
/// It bounds the motion from each frame that it reads to the next, so its surface is a
/// [`MovingSurface`](crate::MovingSurface) for a [`Tracker`](crate::Tracker).
///
/// RAM: `20 K` bytes and some 300.
#[derive(Debug)]
pub struct ModalReader<'f, 'a, const K: usize> {
    frames: FrameReader<'f>,
    modes: Modes<'a>,
    reach: Reach<K>,
    last: Option<LastFrame<K>>,
}

#[derive(Clone, Copy, Debug)]
struct LastFrame<const K: usize> {
    weights: Weights<K>,
    epoch: u32,
    received: Millis,
    /// `None` for weights out of range.
    motion: Option<MotionReading>,
    step: Option<WeightStep<K>>,
}

impl<'f, 'a, const K: usize> ModalReader<'f, 'a, K> {
    /// A reader of surfaces of exactly `K` modes, whose buffers have one row for each mode.
    ///
    /// Cost: two passes over the displacements of all vertices.
    ///
    /// # Errors
    /// [`WeightsError::Count`] for another number of modes, or of rows.
    pub fn new(frames: FrameReader<'f>, modes: &Modes<'a>) -> Result<Self, WeightsError> {
        let expected = modes.count() as u32;
        for found in [K as u32, frames.rows()] {
            if expected != found {
                return Err(WeightsError::Count { expected, found });
            }
        }
        Ok(Self { frames, modes: *modes, reach: Reach::of(modes), last: None })
    }

    /// The published surface and its age at `now`, on the receiver's clock. O(modes); for a new frame O(modes times
    /// anchors).
    ///
    /// The weights are copied, so frames can be published while this one is kept, unlike with [`FrameReader::latest`].
    #[inline]
    pub fn latest(&mut self, now: Millis) -> LatestSurface<ModalFrame<'a, K>> {
        let Self { frames, modes, reach, last } = self;
        frames.latest(now).map(|frame| next(modes, reach, last, &frame))
    }

    /// The published surface, without its age; `None` before the first.
    #[inline]
    pub fn read(&mut self) -> Option<ModalFrame<'a, K>> {
        let frame = self.frames.read()?;
        Some(next(&self.modes, &self.reach, &mut self.last, &frame))
    }
}

/// Returns the frame as a surface, and stores it as the last one read.
fn next<'a, const K: usize>(
    modes: &Modes<'a>,
    reach: &Reach<K>,
    last: &mut Option<LastFrame<K>>,
    frame: &FrameGuard<'_>,
) -> ModalFrame<'a, K> {
    let label = frame.label();
    let mut weights = Weights { values: [0.0; K], stretch: label.stretch };
    for (row, weight) in (0..).zip(&mut weights.values) {
        *weight = frame.position(row).unwrap_or_default().x;
    }
    let now = match last {
        Some(last) if last.is(&label, &weights) => *last,
        _ => LastFrame::new(modes, reach, last.as_ref(), &label, weights),
    };
    *last = Some(now);
    ModalFrame::new(modes, label, &now.weights, now.motion, now.step, frame.age())
}

impl<const K: usize> LastFrame<K> {
    fn is(&self, label: &FrameLabel, weights: &Weights<K>) -> bool {
        let names = (self.epoch, self.received) == (label.epoch, label.received);
        names && self.weights.values == weights.values
    }

    /// The frame after `before`.
    fn new(
        modes: &Modes<'_>,
        reach: &Reach<K>,
        before: Option<&Self>,
        &FrameLabel { epoch, received, .. }: &FrameLabel,
        weights: Weights<K>,
    ) -> Self {
        let mut now = Self { weights, epoch, received, motion: None, step: None };
        // An assembler never publishes weights out of range, for which the sums may wrap.
        if modes.check(&weights.values).is_err() {
            return now;
        }
        let before = before.and_then(|before| Some((before, before.motion?)));
        let Some((before, from)) = before else {
            now.motion = Some(MotionReading::start(modes.motion.tree));
            return now;
        };
        let interval = received.since(before.received);
        let weights = [&before.weights, &weights];
        let step = WeightStep::new(modes, reach, weights, (from, interval), before.step.as_ref());
        now.motion = Some(from.along(step.units));
        now.step = (interval > Millis(0) && interval < Millis(1 << 31)).then_some(step);
        now
    }
}

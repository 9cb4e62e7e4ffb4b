//! The control tick's end of the buffers: the published frame, locked during the read, and the surface between it and
//! the previous one.

// Requirements: F-01, F-05

use glam::Vec3;

use super::atomic::{AtomicU32, Ordering};
use super::buffer::{Buffer, FrameLabel, Position, PredictionCheck};
#[cfg(all(feature = "bus", feature = "control"))]
use super::frames::FRONT;
use super::frames::{Buffers, READING};
use super::motion::{MotionReading, MovingSurface};
use super::moving::SurfaceBlend;
use super::moving::{FARTHEST, clamped};
use super::prediction::Prediction;
use super::{FrameAge, LatestSurface, MeasuredStretch, Millis, StampAge, VertexTable};
#[cfg(feature = "bus")]
use crate::time::elapsed;

/// The end that reads: owned by the control tick.
#[derive(Debug)]
pub struct FrameReader<'f> {
    buffers: Buffers<'f>,
    /// Epoch and age of the last frame read.
    ageing: (u32, StampAge),
}

impl<'f> FrameReader<'f> {
    pub(super) fn new(buffers: Buffers<'f>) -> Self {
        Self { buffers, ageing: (0, StampAge::default()) }
    }

    /// Rows of a frame.
    #[cfg(feature = "modes")]
    pub(crate) const fn rows(&self) -> u32 {
        self.buffers.rows()
    }

    /// The published frame and its age at `now`, on the receiver's clock. [`LatestSurface::within`] a limit gives the
    /// frame, locked as by [`read`](Self::read).
    #[inline]
    pub fn latest(&mut self, now: Millis) -> LatestSurface<FrameGuard<'_>> {
        let (epoch_before, before) = self.ageing;
        let Some(mut guard) = read(&self.buffers) else { return LatestSurface::new(None) };
        let FrameLabel { epoch, received, .. } = guard.label();
        let before = if epoch == epoch_before { before } else { StampAge::default() };
        let ageing = before.at(now, received);
        self.ageing = (epoch, ageing);
        guard.age = ageing.oldest;
        LatestSurface::new(Some((guard, FrameAge { epoch, received, age: ageing.oldest })))
    }

    /// The published frame, locked while the guard lives; `None` before the first.
    ///
    /// Keep the guard for one query, not longer: meanwhile no frame is published. A leaked guard keeps the surface at
    /// its present frame, whose age then grows. This does not check the age: use [`latest`](Self::latest).
    #[inline]
    pub fn read(&mut self) -> Option<FrameGuard<'_>> {
        read(&self.buffers)
    }
}

#[inline]
fn read<'g>(buffers: &'g Buffers<'_>) -> Option<FrameGuard<'g>> {
    let state = buffers.state().fetch_or(READING, Ordering::Acquire);
    let Some([buffer, before]) = buffers.published(state) else {
        buffers.state().fetch_and(!READING, Ordering::Release);
        return None;
    };
    let [view, before] = [buffer, before].map(FrameView::published);
    Some(FrameGuard { state: buffers.state(), view, before, age: Millis(0) })
}

/// The published frame, locked: a [`VertexTable`] with its measured stretch and its position error.
#[derive(Debug)]
pub struct FrameGuard<'f> {
    state: &'f AtomicU32,
    view: FrameView<'f>,
    /// The previous frame, if there are three buffers.
    before: FrameView<'f>,
    /// Age of the frame when it was read.
    age: Millis,
}

impl FrameGuard<'_> {
    /// The facts about this frame.
    #[must_use]
    pub fn label(&self) -> FrameLabel {
        self.view.label()
    }

    /// Its age when it was read.
    #[cfg(feature = "modes")]
    pub(crate) const fn age(&self) -> Millis {
        self.age
    }
}

/// With three buffers the surface moves between frames.
///
/// Both surfaces below hold the published frame until a second one with measured motion has arrived from
/// [`Assembler::continuous`](crate::Assembler::continuous). Their time is that of [`FrameReader::latest`]; a frame from
/// [`FrameReader::read`] is as received.
impl<'f> FrameGuard<'f> {
    /// The surface one frame interval ago, interpolated between the last two frames: exact, but late by that time.
    #[must_use]
    pub fn interpolated(&self) -> SurfaceBlend<'_, FrameView<'f>, FrameView<'f>> {
        match self.last_step() {
            Some(step) => {
                let lag = if step.interval > self.age { step.interval } else { self.age };
                step.inside([&self.before, &self.view], self.age).lagging(lag)
            }
            None => self.held(),
        }
    }

    /// The current surface, if every vertex has kept its velocity since the last frame: its error is the change of the
    /// motion. The error, estimated from the last frames, is part of its
    /// [`position_error`](VertexTable::position_error), and so of each answer's accuracy.
    ///
    /// The extrapolation lasts for twice the time between the last two frames; then the surface is held. That suffices
    /// for frames at a steady rate with a transit of one frame interval. The surface is held at once before the third
    /// frame, which gives the first estimate, and if the extrapolation would be stretched beyond the tree's limit. The
    /// time for which it is held is its [`lag`](SurfaceBlend::lag).
    #[must_use]
    pub fn extrapolated(&self) -> SurfaceBlend<'_, FrameView<'f>, FrameView<'f>> {
        let (ahead, before) = (self.view.buffer.head.ahead(), self.before.buffer.head.ahead());
        match self.last_step() {
            Some(step) if ahead.sigma >= 0.0 && ahead.residual >= 0.0 => {
                // A single small residual may be by chance. False for NaN.
                let is_worse = before.residual > ahead.residual;
                let residual = if is_worse { before.residual } else { ahead.residual };
                let lag = Millis(self.age.0.saturating_sub(step.end().0));
                let ahead = PredictionCheck { residual, ..ahead };
                step.outside([&self.before, &self.view], self.age, ahead).lagging(lag)
            }
            _ => self.held(),
        }
    }

    /// The previous published frame; zeros as at the start, if there is none.
    #[cfg(loom)]
    #[must_use]
    pub fn before(&self) -> &FrameView<'f> {
        &self.before
    }

    /// Number of this frame's buffer: buffers alternate, and the first frame is in number 1.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) fn number(&self) -> u32 {
        self.state.load(Ordering::Relaxed) & FRONT
    }

    /// This frame as received.
    pub(crate) fn held(&self) -> SurfaceBlend<'_, FrameView<'f>, FrameView<'f>> {
        SurfaceBlend::held(&self.view, self.view.motion()).lagging(self.age)
    }

    fn last_step(&self) -> Option<LastStep> {
        LastStep::between(&self.before, &self.view)
    }
}

impl Drop for FrameGuard<'_> {
    fn drop(&mut self) {
        self.state.fetch_and(!READING, Ordering::Release);
    }
}

impl VertexTable for FrameGuard<'_> {
    fn len(&self) -> usize {
        self.view.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.view.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        self.view.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.view.stretch()
    }

    fn position_error(&self) -> f32 {
        self.view.position_error()
    }
}

/// Its motion since other frames is known if an [`Assembler`](crate::Assembler) with a tree's admission check
/// published them all.
impl MovingSurface for FrameGuard<'_> {
    fn motion(&self) -> Option<MotionReading> {
        self.view.motion()
    }
}

/// The step from a published frame to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LastStep {
    from: MotionReading,
    motion: MotionReading,
    units: u64,
    /// Time between the two frames, on the receiver's clock, above 0.
    interval: Millis,
}

impl LastStep {
    /// `None` if the motion between the two was not measured, or they have the same time.
    pub fn between(before: &FrameView<'_>, after: &FrameView<'_>) -> Option<Self> {
        let (from, motion) = (before.motion()?, after.motion()?);
        let units = motion.after(&from)?;
        // Two captures in the wrong order, or at the same time, give no velocity.
        let interval = after.label().received.since(before.label().received);
        (interval > Millis(0) && interval < Millis(1 << 31)).then_some(Self {
            from,
            motion,
            units,
            interval,
        })
    }

    /// The surface between the two, for `age` after the later less the time between them.
    fn inside<'v, V: VertexTable>(
        &self,
        [before, after]: [&'v V; 2],
        age: Millis,
    ) -> SurfaceBlend<'v, V, V> {
        let t = self.elapsed(age);
        let between = SurfaceBlend::inside(before, after, t, self.from, self.units);
        between.at_rate(self.rate(t, 1.0))
    }

    /// The surface `age` after the later frame, if every vertex keeps its velocity. `ahead` has the measurements of
    /// this extrapolation.
    fn outside<'v, V: VertexTable>(
        &self,
        [before, after]: [&'v V; 2],
        age: Millis,
        ahead: PredictionCheck,
    ) -> SurfaceBlend<'v, V, V> {
        let t = clamped(self.elapsed(age), FARTHEST);
        let prediction = Prediction::new(self.units, &ahead, t);
        let between = SurfaceBlend::outside(before, after, t, self.motion, self.units);
        between.on(prediction).measured(ahead).at_rate(self.rate(t, FARTHEST))
    }

    /// The fraction of the step that an extrapolation adds to the later frame after this time.
    #[cfg(feature = "bus")]
    pub fn ahead(&self, age: Millis) -> f32 {
        clamped(self.elapsed(age), FARTHEST)
    }

    /// Units of the odometer from the earlier frame to the later.
    #[cfg(feature = "bus")]
    pub const fn units(&self) -> u64 {
        self.units
    }

    /// The age at which the extrapolation ends, rounded down.
    const fn end(&self) -> Millis {
        Millis((self.interval.0 as f32 * FARTHEST) as u32)
    }

    /// Steps per second; 0 from `most` on, where the surface is held.
    fn rate(&self, t: f32, most: f32) -> f32 {
        if t < most { 1_000.0 / self.interval.0 as f32 } else { 0.0 }
    }

    fn elapsed(&self, age: Millis) -> f32 {
        age.0 as f32 / self.interval.0 as f32
    }
}

/// A view of one buffer: a [`VertexTable`] with the facts about its frame, once published.
#[derive(Clone, Copy, Debug)]
pub struct FrameView<'f> {
    pub(super) buffer: Buffer<'f>,
    /// Whether the buffer's label belongs to its positions.
    pub(super) is_published: bool,
}

impl<'f> FrameView<'f> {
    pub(super) const fn published(buffer: Buffer<'f>) -> Self {
        Self { buffer, is_published: true }
    }

    /// The facts about the frame; arbitrary for a frame not yet labelled.
    pub(crate) fn label(&self) -> FrameLabel {
        self.buffer.head.label()
    }

    pub(crate) fn motion(&self) -> Option<MotionReading> {
        self.buffer.head.motion()
    }

    /// Time from this frame to one with the stamp `received`.
    #[cfg(feature = "bus")]
    pub(crate) fn time_to(&self, received: Millis) -> Millis {
        elapsed(received, self.buffer.head.received())
    }
}

impl VertexTable for FrameView<'_> {
    fn len(&self) -> usize {
        self.buffer.rows.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.buffer.rows.get(vertex as usize).map(Position::get)
    }

    fn epoch(&self) -> Option<u32> {
        self.is_published.then(|| self.buffer.head.epoch())
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        if self.is_published { self.buffer.head.stretch() } else { None }
    }

    fn position_error(&self) -> f32 {
        if self.is_published { self.buffer.head.position_error() } else { 0.0 }
    }
}

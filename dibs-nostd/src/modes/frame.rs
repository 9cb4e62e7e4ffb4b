//! A modal surface from the bus: as received, interpolated between it and the previous frame, and extrapolated.
//!
//! Weights are blended, not positions: a vertex costs as much as on the frame itself. The stretch between two shapes is
//! bounded by convexity, as in the [bound](super::bound) of a frame.

use glam::Vec3;

use super::bound::ROUNDING;
use super::reach::Reach;
use super::{ModalSurface, Modes};
use crate::math::order::{larger, smaller};
use crate::surface::motion::sealed::Sealed;
use crate::surface::{
    FARTHEST, FrameLabel, MeasuredStretch, Millis, MotionReading, MovingSurface, Prediction,
    PredictionCheck, VertexTable, clamped, grown,
};

/// The weights of a surface, and a bound on its stretch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights<const K: usize> {
    pub values: [f32; K],
    pub stretch: Option<MeasuredStretch>,
}

impl<const K: usize> Weights<K> {
    fn surface<'a>(&self, modes: &Modes<'a>) -> ModalSurface<'a, K> {
        ModalSurface::new(modes, self.values.iter().copied())
    }

    /// The blend with another surface: `t` 0 is this one, 1 the other.
    fn towards(&self, other: &Self, t: f32, modes: &Modes<'_>) -> Self {
        let mut values = self.values;
        for (value, other) in values.iter_mut().zip(&other.values) {
            *value += (other - *value) * t;
        }
        let stretch = match (self.stretch, other.stretch) {
            (Some(old), Some(new)) => {
                let sigma = (1.0 - t) * old.sigma() + t * new.sigma();
                old.of_both(new, sigma * ROUNDING + modes.header.slack)
            }
            _ => None,
        };
        Self { values, stretch }
    }
}

/// The step from the previous frame to this one, and its extrapolation.
#[derive(Clone, Copy, Debug)]
pub(super) struct WeightStep<const K: usize> {
    before: Weights<K>,
    /// The end of the extrapolation, its weights within their ranges.
    end: Weights<K>,
    /// Time from the previous frame to this one, on the receiver's clock.
    interval: Millis,
    /// The odometer's reading at the previous frame.
    from: MotionReading,
    /// Odometer units from the previous frame to this one, and from this one to the end.
    pub units: u64,
    units_ahead: u64,
    /// Distances of the previous frame and of this one from their extrapolations; NaN if unknown.
    residuals: [f32; 2],
    /// The second of them in units.
    ahead: PredictionCheck,
}

impl<const K: usize> WeightStep<K> {
    /// The step from a frame with the reading `from` to the next.
    ///
    /// Cost: O(modes times anchors).
    pub fn new(
        modes: &Modes<'_>,
        reach: &Reach<K>,
        [before, now]: [&Weights<K>; 2],
        (from, interval): (MotionReading, Millis),
        last: Option<&Self>,
    ) -> Self {
        let mut end = *now;
        // A quarter of the change of weights that would leave their ranges: no more than such a weight itself.
        let rest = Weights { values: [0.0; K], stretch: None };
        let mut cut = rest;
        let ends = end.values.iter_mut().zip(&mut cut.values);
        for (((end, cut), before), mode) in ends.zip(&before.values).zip(modes.modes()) {
            let far = *end + (*end - before) * FARTHEST;
            let near = larger(mode.low, far);
            *end = smaller(mode.high, near);
            *cut = (far - *end) / 4.0;
        }
        end.stretch = Some(modes.bound(&end.values));
        let surface = now.surface(modes);
        let units = |other: &Weights<K>| {
            modes.motion.units_of(reach.between(&other.surface(modes), &surface))
        };
        let (step, units_ahead) = (units(before), units(&end));
        let (mut residuals, mut ahead) = ([f32::NAN; 2], PredictionCheck::UNKNOWN);
        if let Some(last) = last {
            let t = last.ahead(interval);
            let expected = before.towards(&last.end, t, modes);
            // For a velocity that changes at a constant rate, one time of this step later.
            let longer = 2.0 * interval.0 as f32 / (interval.0 as f32 + last.interval.0 as f32);
            let longer = larger(1.0, longer);
            residuals =
                [last.residuals[1], reach.between(&expected.surface(modes), &surface) * longer];
            // Weights and `t` are rounded by a few times 2^-24.
            let rounding = (units(&rest) + step + last.units_ahead) / (1 << 20);
            // At the end, where the error has tripled, the surface differs from its prediction by the whole clipped
            // part.
            let cut = reach.between(&rest.surface(modes), &cut.surface(modes)) * (4.0 / 3.0);
            let off = units(&expected) + modes.motion.units_of(cut) + rounding + 2;
            let passed = (t * last.units_ahead as f32) as u64;
            if let (Ok(passed), Ok(off)) = (passed.try_into(), off.try_into()) {
                ahead = PredictionCheck { passed, off, ..ahead };
            }
        }
        let (before, units) = (*before, step);
        Self { before, end, interval, from, units, units_ahead, residuals, ahead }
    }

    /// The `t` of the blend with the end, at this age.
    fn ahead(&self, age: Millis) -> f32 {
        clamped(age.0 as f32 / self.interval.0 as f32, FARTHEST) / FARTHEST
    }
}

/// A published modal surface: a [`VertexTable`] with a bound on its stretch and its position error, and a
/// [`MovingSurface`].
///
/// RAM: `16 K` bytes and some 400.
#[derive(Clone, Copy, Debug)]
pub struct ModalFrame<'a, const K: usize> {
    surface: ModalSurface<'a, K>,
    label: FrameLabel,
    weights: Weights<K>,
    motion: Option<MotionReading>,
    step: Option<WeightStep<K>>,
    /// Age of the frame when it was read.
    age: Millis,
    is_frame: bool,
    residual: f32,
    /// The part of `residual` included in its error so far.
    own_error: f32,
    lag: Millis,
}

impl<'a, const K: usize> ModalFrame<'a, K> {
    /// A frame as received.
    pub(super) fn new(
        modes: &Modes<'a>,
        label: FrameLabel,
        weights: &Weights<K>,
        motion: Option<MotionReading>,
        step: Option<WeightStep<K>>,
        age: Millis,
    ) -> Self {
        let surface = weights.surface(modes);
        let (is_frame, residual, own_error) = (true, f32::NAN, 0.0);
        let (weights, lag) = (*weights, age);
        Self { surface, label, weights, motion, step, age, is_frame, residual, own_error, lag }
    }

    /// The facts about this frame; for a surface between frames, about the later one. Its position error is that of the
    /// modes for the motion to which they were fitted.
    #[must_use]
    pub const fn label(&self) -> FrameLabel {
        self.label
    }

    /// The surface one frame interval ago, interpolated between the last two frames read: exact, but late by that time.
    ///
    /// This and [`extrapolated`](Self::extrapolated) are the frame itself until a second one with another time has been
    /// read. A frame from [`ModalReader::read`](super::ModalReader::read) has no age. O(modes).
    #[must_use]
    pub fn interpolated(&self) -> Self {
        let Some(step) = &self.step else { return *self };
        let t = clamped(self.age.0 as f32 / step.interval.0 as f32, 1.0);
        let weights = step.before.towards(&self.weights, t, self.surface.modes());
        let motion = step.from.along((t * step.units as f32) as u64);
        let lag = if step.interval > self.age { step.interval } else { self.age };
        self.moved(weights, Some(motion), (f32::NAN, 0.0), lag)
    }

    /// The current surface, if every weight has kept its velocity since the last frame. Its error is the change of the
    /// motion, estimated from the last frames; it is part of its [`position_error`](VertexTable::position_error).
    /// O(modes).
    ///
    /// The extrapolation lasts for twice the time between the last two frames; then the surface is held. No weight
    /// leaves its range. The surface is held at once before the third frame, and if the extrapolation might be
    /// stretched beyond the tree's limit.
    #[must_use]
    pub fn extrapolated(&self) -> Self {
        let (Some(step), Some(motion)) = (&self.step, self.motion) else { return *self };
        let modes = self.surface.modes();
        let is_within = |end: MeasuredStretch| end.sigma() <= modes.stretch_limit();
        // False for NaN: the error is not known before the third frame.
        let is_known = step.residuals[1] >= 0.0;
        if !is_known || !step.end.stretch.is_some_and(is_within) {
            return *self;
        }
        let t = step.ahead(self.age);
        let weights = self.weights.towards(&step.end, t, modes);
        let prediction = Prediction::new(step.units, &step.ahead, t * FARTHEST);
        let motion = motion.beside((t * step.units_ahead as f32) as u64);
        let motion = motion.map(|motion| motion.on(prediction));
        // A single small residual may be by chance. False for NaN.
        let [before, now] = step.residuals;
        let residual = larger(now, before);
        let end = Millis((step.interval.0 as f32 * FARTHEST) as u32);
        let lag = Millis(self.age.0.saturating_sub(end.0));
        self.moved(weights, motion, (residual, grown(residual, t * FARTHEST)), lag)
    }

    /// A bound (mm) on the distance of the last frame's vertices from its extrapolation by the two previous frames; the
    /// larger value of the last two frames. It estimates this surface's own error at the time of the next frame.
    /// [`position_error`](VertexTable::position_error) includes the part reached so far. `None` for a surface that is
    /// not extrapolated.
    #[must_use]
    pub fn residual(&self) -> Option<f32> {
        (self.residual >= 0.0).then_some(self.residual)
    }

    /// How far this surface is behind the present: see [`SurfaceBlend::lag`](crate::SurfaceBlend::lag).
    #[must_use]
    pub const fn lag(&self) -> Option<Millis> {
        Some(self.lag)
    }

    fn moved(
        &self,
        weights: Weights<K>,
        motion: Option<MotionReading>,
        (residual, own_error): (f32, f32),
        lag: Millis,
    ) -> Self {
        let surface = weights.surface(self.surface.modes());
        let (step, is_frame) = (None, false);
        Self { surface, weights, motion, step, residual, own_error, lag, is_frame, ..*self }
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
        self.is_frame.then_some(self.label.epoch)
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.weights.stretch
    }

    fn position_error(&self) -> f32 {
        self.label.position_error + self.own_error
    }
}

impl<const K: usize> Sealed for ModalFrame<'_, K> {}

/// Its motion since other frames of one reader is known, also between frames.
impl<const K: usize> MovingSurface for ModalFrame<'_, K> {
    fn motion(&self) -> Option<MotionReading> {
        self.motion
    }
}

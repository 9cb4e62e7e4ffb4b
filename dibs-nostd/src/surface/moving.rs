//! The surface between two frames and after the last, computed only for the vertices that are read.
//!
//! Imaging gives some tens of frames a second and a control loop ticks a thousand times a second, so a surface held
//! from frame to frame jumps. A tree needs no refitting, so a surface that moves at every tick costs only the sums
//! below, for the vertices that a query reads.

// Requirement: F-05

use glam::Vec3;

use super::buffer::PredictionCheck;
use super::motion::{MotionReading, MovingSurface, MovingTable};
use super::prediction::Prediction;
use crate::math::order::{larger, smaller};
use crate::{MeasuredStretch, Millis, VertexTable};

/// Two frames that follow one another, as [`Odometer::step`](crate::Odometer::step) measured them.
///
/// It borrows both, so that measured positions cannot change.
#[derive(Debug)]
pub struct Step<'v, W: ?Sized, V: ?Sized> {
    pub(super) before: &'v W,
    pub(super) after: &'v V,
    pub(super) from: MotionReading,
    pub(super) motion: MotionReading,
    pub(super) units: u64,
    pub(super) is_measured: bool,
    pub(super) length: f32,
}

impl<'v, W: VertexTable + ?Sized, V: VertexTable + ?Sized> Step<'v, W, V> {
    /// The earlier frame.
    #[must_use]
    pub const fn before(&self) -> MovingTable<'v, W> {
        MovingTable { table: self.before, motion: self.from }
    }

    /// The later frame.
    #[must_use]
    pub const fn after(&self) -> MovingTable<'v, V> {
        MovingTable { table: self.after, motion: self.motion }
    }

    /// Upper bound (mm) on the motion of any vertex. Infinite if a position is not finite.
    #[must_use]
    pub const fn length(&self) -> f32 {
        if self.is_measured { self.length } else { f32::INFINITY }
    }

    /// The surface between the two: `t` 0 is the earlier frame and 1 the later. It is exact, but one frame late.
    ///
    /// `t` is clamped to 0..=1. If both frames carry their stretch, so does the surface: see
    /// [`SurfaceBlend::stretch`](VertexTable::stretch).
    #[must_use]
    pub fn at(&self, t: f32) -> SurfaceBlend<'v, W, V> {
        let between = SurfaceBlend::inside(self.before, self.after, t, self.from, self.units);
        self.unless_unmeasured(between)
    }

    /// The surface after the later frame, if every vertex keeps its velocity between the two: `t` 0 is the later frame,
    /// 1 one frame interval after it. It is current; its error is the change of the motion.
    ///
    /// `t` is clamped to 0..=2. Beyond the frames no frame's measurement bounds the stretch: measure it
    /// ([`measure_stretch`](crate::measure_stretch)), unless both frames carry their own, as frames from a bus do:
    /// [`FrameGuard::extrapolated`](crate::FrameGuard::extrapolated).
    #[must_use]
    pub fn beyond(&self, t: f32) -> SurfaceBlend<'v, W, V> {
        let between = SurfaceBlend::outside(self.before, self.after, t, self.motion, self.units);
        self.unless_unmeasured(between)
    }

    /// The same step of two surfaces whose vertices move at most so many times as far as these rows.
    #[cfg(feature = "nodes")]
    pub(crate) fn carried<'s, X: ?Sized, Y: ?Sized>(
        &self,
        before: &'s X,
        after: &'s Y,
        amplification: f32,
    ) -> Step<'s, X, Y> {
        let length = self.length * amplification * (1.0 + f32::EPSILON);
        let Self { from, motion, units, is_measured, .. } = *self;
        Step { before, after, from, motion, units, is_measured, length }
    }

    fn unless_unmeasured(&self, mut between: SurfaceBlend<'v, W, V>) -> SurfaceBlend<'v, W, V> {
        if !self.is_measured {
            between.motion = None;
        }
        between
    }
}

/// Longest extrapolation, in units of the time between the frames. At a steady rate a frame whose transit takes one
/// frame interval is two intervals old when the next one arrives.
pub(crate) const FARTHEST: f32 = 2.0;

/// The error of an extrapolation by `beyond` frame intervals, if it was `residual` after one, for a velocity that
/// changes at a constant rate.
pub(crate) fn grown(residual: f32, beyond: f32) -> f32 {
    residual * beyond * (beyond + 1.0) * 0.5
}

/// A number clamped to 0 to `most`: 0 for NaN.
pub(crate) fn clamped(t: f32, most: f32) -> f32 {
    let t = larger(0.0, t);
    smaller(most, t)
}

/// A surface between two frames or beyond the second: `before + t * (after - before)`.
///
/// A position differs from the exact sum by at most 16 * 2^-24 of the coordinates' size.
#[derive(Debug)]
pub struct SurfaceBlend<'v, W: ?Sized, V: ?Sized> {
    before: &'v W,
    after: &'v V,
    /// 0 is the earlier frame, 1 the later, 2 as far beyond, and 3 the farthest.
    t: f32,
    motion: Option<MotionReading>,
    ahead: PredictionCheck,
    /// Steps per second from the earlier frame to the later; 0 if it is held, or without a clock.
    rate: f32,
    /// How far it is behind the present, beyond what its error covers; `None` without a clock.
    lag: Option<Millis>,
}

impl<'v, W: VertexTable + ?Sized, V: VertexTable + ?Sized> SurfaceBlend<'v, W, V> {
    /// The surface between two frames, which are `units` of the odometer apart.
    pub(super) fn inside(
        before: &'v W,
        after: &'v V,
        t: f32,
        from: MotionReading,
        units: u64,
    ) -> Self {
        let t = clamped(t, 1.0);
        // The error is less than a few units, within a tracker's slack.
        let along = (t * units as f32) as u64;
        let motion = Some(from.along(along));
        Self { before, after, t, motion, ahead: PredictionCheck::UNKNOWN, rate: 0.0, lag: None }
    }

    /// The surface after the later frame.
    pub(super) fn outside(
        before: &'v W,
        after: &'v V,
        t: f32,
        last: MotionReading,
        units: u64,
    ) -> Self {
        let t = clamped(t, FARTHEST);
        let motion = last.beside((t * units as f32) as u64);
        Self {
            before,
            after,
            t: 1.0 + t,
            motion,
            ahead: PredictionCheck::UNKNOWN,
            rate: 0.0,
            lag: None,
        }
    }

    /// The same along a prediction.
    pub(super) fn on(mut self, prediction: Prediction) -> Self {
        self.motion = self.motion.map(|motion| motion.on(prediction));
        self
    }

    /// The same with the measurements of the later frame's prediction.
    pub(super) const fn measured(mut self, ahead: PredictionCheck) -> Self {
        self.ahead = ahead;
        self
    }

    /// The same, at this many steps per second.
    pub(super) const fn at_rate(mut self, rate: f32) -> Self {
        self.rate = rate;
        self
    }

    /// The same, this far behind the present.
    pub(super) const fn lagging(mut self, lag: Millis) -> Self {
        self.lag = Some(lag);
        self
    }

    /// How far this surface is behind the present: the tissue may have moved for this time, and for its transit time.
    /// For [`Observation::lag`](crate::failsafe::Observation::lag).
    ///
    /// 0 if it is extrapolated, with its error in [`position_error`](VertexTable::position_error); after the end of its
    /// extrapolation, the time since that end. The time between the frames if it is between them. Its age if it is
    /// held. `None` for a surface of a [`Step`], which has no clock.
    #[must_use]
    pub const fn lag(&self) -> Option<Millis> {
        self.lag
    }

    /// The surface's time in steps: 0 is the earlier frame, 1 the later, 2 one interval after it, and 3 the end.
    #[must_use]
    pub const fn t(&self) -> f32 {
        self.t
    }

    /// The earlier frame; the later one if the surface is held.
    #[must_use]
    pub const fn before(&self) -> &'v W {
        self.before
    }

    /// Steps per second from the earlier frame to the later; 0 if it is held, or without a clock.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) const fn rate(&self) -> f32 {
        self.rate
    }

    /// The velocity (mm/s) of a point given by vertices and weights, from one frame to the other; zero for a surface
    /// that is held, one of a [`Step`], and vertices outside of the table.
    #[must_use]
    pub fn velocity<const N: usize>(&self, vertices: [u32; N], weights: [f32; N]) -> Vec3 {
        let mut step = Vec3::ZERO;
        if self.rate > 0.0 {
            for (corner, weight) in vertices.into_iter().zip(weights) {
                let (before, after) = (self.before.position(corner), self.after.position(corner));
                let moved = before.zip(after).map_or(Vec3::ZERO, |(before, after)| after - before);
                step += moved * weight;
            }
        }
        step * self.rate
    }

    /// The largest distance (mm) of a vertex of a frame from its extrapolation by the two previous frames; the larger
    /// value of the last two frames. It estimates this surface's own error at the time of the next frame. If the frame
    /// interval grew, it is scaled as for a velocity that changes at a constant rate.
    /// [`position_error`](VertexTable::position_error) includes the part reached so far. `None` for a surface that is
    /// not extrapolated.
    #[must_use]
    pub fn residual(&self) -> Option<f32> {
        (self.ahead.residual >= 0.0).then_some(self.ahead.residual)
    }
}

impl<'v, V: VertexTable + ?Sized> SurfaceBlend<'v, V, V> {
    /// A frame, held.
    pub(super) const fn held(frame: &'v V, motion: Option<MotionReading>) -> Self {
        Self {
            before: frame,
            after: frame,
            t: 1.0,
            motion,
            ahead: PredictionCheck::UNKNOWN,
            rate: 0.0,
            lag: None,
        }
    }

    /// The end of the extrapolation, whose motion is not measured.
    pub(crate) const fn ahead(before: &'v V, after: &'v V) -> Self {
        let t = 1.0 + FARTHEST;
        Self {
            before,
            after,
            t,
            motion: None,
            ahead: PredictionCheck::UNKNOWN,
            rate: 0.0,
            lag: None,
        }
    }
}

impl<W: VertexTable + ?Sized, V: VertexTable + ?Sized> VertexTable for SurfaceBlend<'_, W, V> {
    fn len(&self) -> usize {
        let (before, after) = (self.before.len(), self.after.len());
        if before == after { after } else { 0 }
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let (before, after) = (self.before.position(vertex)?, self.after.position(vertex)?);
        Some(before + (after - before) * self.t)
    }

    /// A bound by the frames' stretches: gradients are linear in the positions, and the largest singular value (or
    /// edge) is convex. Between the frames it is their mean by `t`. Beyond, it is the mean of the later frame's and
    /// that of the end of the extrapolation if that was measured, otherwise their sum by the triangle inequality.
    /// `None` if a frame was not measured.
    fn stretch(&self) -> Option<MeasuredStretch> {
        let (before, after) = (self.before.stretch()?, self.after.stretch()?);
        let (t, beyond) = (self.t, self.t - 1.0);
        let (old, new) = (before.sigma(), after.sigma());
        let sigma = if t <= 1.0 {
            (1.0 - t) * old + t * new
        } else if self.ahead.sigma >= 0.0 {
            let part = beyond / FARTHEST;
            (1.0 - part) * new + part * self.ahead.sigma
        } else {
            t * new + beyond * old
        };
        // The sum is rounded by at most three halves of a unit in its last place.
        before.of_both(after, sigma * (1.0 + 2.0 * f32::EPSILON))
    }

    /// The frames' errors, weighted as in each position, plus for an extrapolated surface the change of the motion: the
    /// [residual of the last frames](SurfaceBlend::residual), growing as for a velocity that changes at a constant
    /// rate, to three times its size at the end. That is an estimate: no measurement of the past bounds it.
    fn position_error(&self) -> f32 {
        let (before, after) = (self.before.position_error(), self.after.position_error());
        let frames = (1.0 - self.t).abs() * before + self.t * after;
        match self.residual() {
            Some(residual) => frames + grown(residual, self.t - 1.0),
            None => frames,
        }
    }
}

impl<W: VertexTable + ?Sized, V: VertexTable + ?Sized> MovingSurface for SurfaceBlend<'_, W, V> {
    fn motion(&self) -> Option<MotionReading> {
        self.motion
    }
}

#[cfg(test)]
mod tests;

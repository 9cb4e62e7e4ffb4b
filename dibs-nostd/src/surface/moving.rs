//! The surface between two frames and after the last, computed only for the vertices that are read.
//!
//! Imaging gives some tens of frames a second, a control loop ticks a thousand times, so a surface held from frame to
//! frame jumps. A tree needs no refitting, so a surface that moves at every tick costs only the sums below, at the
//! vertices that a query reads.

use glam::Vec3;

use super::motion::{Moved, MovingSurface, Travel};
use crate::{MeasuredStretch, VertexTable};

/// Two frames that follow one another, as [`Odometer::step`](crate::Odometer::step) measured them.
///
/// It borrows both, so that measured positions cannot change.
#[derive(Debug)]
pub struct Step<'v, W: ?Sized, V: ?Sized> {
    pub(super) before: &'v W,
    pub(super) after: &'v V,
    pub(super) from: Travel,
    pub(super) travel: Travel,
    pub(super) units: u64,
    pub(super) is_measured: bool,
    pub(super) length: f32,
}

impl<'v, W: VertexTable + ?Sized, V: VertexTable + ?Sized> Step<'v, W, V> {
    /// The earlier frame.
    #[must_use]
    pub const fn before(&self) -> Moved<'v, W> {
        Moved { table: self.before, travel: self.from }
    }

    /// The later frame.
    #[must_use]
    pub const fn after(&self) -> Moved<'v, V> {
        Moved { table: self.after, travel: self.travel }
    }

    /// The largest distance that a vertex moved, rounded up (mm). Infinite where a position is not finite.
    #[must_use]
    pub const fn length(&self) -> f32 {
        if self.is_measured { self.length } else { f32::INFINITY }
    }

    /// The surface between the two: `share` 0 is the earlier frame and 1 the later. It is exact, but late by a frame.
    ///
    /// Its stretch is at most the larger of the two frames' (gradients are linear in positions, and the largest
    /// singular value is convex): see [`MeasuredStretch::or_larger`](crate::MeasuredStretch::or_larger). `share` is
    /// clamped to 0..=1.
    #[must_use]
    pub fn at(&self, share: f32) -> Between<'v, W, V> {
        // Written so that a NaN becomes 0.
        let share = if share > 0.0 { share } else { 0.0 };
        let share = if share < 1.0 { share } else { 1.0 };
        // Off by less than a few units, within a tracker's slack.
        let along = (share * self.units as f32) as u64;
        self.moved_by(share, self.from.beyond(along, 0))
    }

    /// The surface after the later frame, if every vertex keeps its velocity between the two: `share` 0 is the later
    /// frame, 1 as long after it as the earlier frame was before. It is on time, and wrong by the change of the motion.
    ///
    /// Its stretch is at most the later frame's plus `share` times that of the difference of the two. `share` is
    /// clamped to 0..=`FARTHEST_SHARE`.
    #[must_use]
    pub fn beyond(&self, share: f32) -> Between<'v, W, V> {
        let share = if share > 0.0 { share } else { 0.0 };
        let share = if share < FARTHEST_SHARE { share } else { FARTHEST_SHARE };
        let aside = (share * self.units as f32) as i64;
        self.moved_by(1.0 + share, self.travel.beyond(0, aside))
    }

    fn moved_by(&self, share: f32, travel: Travel) -> Between<'v, W, V> {
        let travel = self.is_measured.then_some(travel);
        Between { before: self.before, after: self.after, share, travel }
    }
}

/// Longest extrapolation, in units of the time between the frames: a longer one is worse than the last frame.
pub const FARTHEST_SHARE: f32 = 1.0;

/// A surface on its way from one frame to another, or beyond: `before + share * (after - before)`.
///
/// A position is within 16 * 2^-24 of the coordinates' size of the exact sum.
#[derive(Debug)]
pub struct Between<'v, W: ?Sized, V: ?Sized> {
    before: &'v W,
    after: &'v V,
    share: f32,
    travel: Option<Travel>,
}

impl<W: VertexTable + ?Sized, V: VertexTable + ?Sized> VertexTable for Between<'_, W, V> {
    fn len(&self) -> usize {
        let (before, after) = (self.before.len(), self.after.len());
        if before == after { after } else { 0 }
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let (before, after) = (self.before.position(vertex)?, self.after.position(vertex)?);
        Some(before + (after - before) * self.share)
    }

    /// Between the two frames a bound on both holds; beyond them there is no measurement.
    fn stretch(&self) -> Option<MeasuredStretch> {
        let (before, after) = (self.before.stretch()?, self.after.stretch()?);
        if self.share <= 1.0 { before.or_larger(after) } else { None }
    }

    fn position_error(&self) -> f32 {
        let (before, after) = (self.before.position_error(), self.after.position_error());
        (1.0 - self.share).abs() * before + self.share * after
    }
}

impl<W: VertexTable + ?Sized, V: VertexTable + ?Sized> MovingSurface for Between<'_, W, V> {
    fn travel(&self) -> Option<Travel> {
        self.travel
    }
}

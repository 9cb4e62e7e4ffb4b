//! The surface between two frames and after the last: positions computed for the vertices that are read, no
//! others.
//!
//! Imaging gives some tens of frames a second, a control loop asks a thousand times: a surface that is held
//! from frame to frame jumps. A tree needs no refitting, so a surface that moves at every tick costs it only the
//! sums below, at the vertices that a query reads.

use glam::Vec3;

use super::motion::{Moved, MovingSurface, Travel};
use crate::{MeasuredStretch, VertexTable};

/// Two frames that follow one another, as [`Odometer::step`](crate::Odometer::step) measured them.
///
/// It borrows both: measured positions cannot change while it lives.
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

    /// The later frame: the surface held.
    #[must_use]
    pub const fn after(&self) -> Moved<'v, V> {
        Moved { table: self.after, travel: self.travel }
    }

    /// The largest distance that a vertex moved, rounded up (mm). Infinite where a position is not finite.
    #[must_use]
    pub const fn length(&self) -> f32 {
        if self.is_measured { self.length } else { f32::INFINITY }
    }

    /// The surface between the two: `share` 0 is the earlier frame and 1 the later. Certain, and late by a frame.
    ///
    /// Its stretch is at most the larger of the two frames' (gradients are linear in positions, and the largest
    /// singular value is convex): see [`MeasuredStretch::or_larger`](crate::MeasuredStretch::or_larger).
    /// A number outside 0..=1 becomes the nearer of the two.
    #[must_use]
    pub fn at(&self, share: f32) -> Between<'v, W, V> {
        // Written so that a NaN becomes a frame.
        let share = if share > 0.0 { share } else { 0.0 };
        let share = if share < 1.0 { share } else { 1.0 };
        // Off by less than a few units; a tracker spares more.
        let along = (share * self.units as f32) as u64;
        self.moved_by(share, self.from.beyond(along, 0))
    }

    /// The surface after the later frame, if every vertex keeps the velocity that it had between the two: `share` 1 is
    /// as long after as the earlier frame was before, 0 the later frame itself. It is on time, and wrong by as much as
    /// the motion changes.
    ///
    /// Its stretch is at most the later frame's plus `share` times that of the difference of the two:
    /// see `measure_stretch` of it. Held to 0..=`FARTHEST_SHARE`.
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

/// The farthest that a surface is extrapolated, in units of the time between its frames: beyond that the guess is
/// worth less than the last frame.
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

    /// Between the two frames a bound of both is one of all; beyond them there is no measurement.
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

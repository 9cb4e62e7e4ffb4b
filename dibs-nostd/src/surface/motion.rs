//! The motion of a surface: the odometer by which a tracker's bounds run out.
//!
//! A bound on a distance holds until tool and surface have moved by more than its slack. An odometer is a number that
//! grows, from frame to frame, by at least the largest motion of any vertex. Two readings, any number of frames apart,
//! bound the motion between them.
//!
//! One file, because reading, unit and odometer keep their fields private.

// Requirement: T-04

mod hold;

use glam::Vec3;

use super::atomic::unmodelled::{AtomicU32, Ordering};
use super::moving::Step;
use super::prediction::Prediction;
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::{Index, MeasuredStretch, Tree, VertexTable};

/// A surface whose motion is known: a table of positions with its odometer's reading.
///
/// Sealed, so that only a measurement can state a motion.
pub trait MovingSurface: VertexTable + sealed::Sealed {
    /// The odometer's reading at this frame; `None` if the motion is not measured.
    fn motion(&self) -> Option<MotionReading>;
}

pub(crate) mod sealed {
    pub trait Sealed {}
    impl<V: super::VertexTable + ?Sized> Sealed for super::MovingTable<'_, V> {}
    impl<S: super::MovingSurface + ?Sized> Sealed for &S {}
    impl Sealed for crate::FrameGuard<'_> {}
    impl<W, V> Sealed for crate::surface::moving::SurfaceBlend<'_, W, V>
    where
        W: super::VertexTable + ?Sized,
        V: super::VertexTable + ?Sized,
    {
    }
}

impl<S: MovingSurface + ?Sized> MovingSurface for &S {
    fn motion(&self) -> Option<MotionReading> {
        (**self).motion()
    }
}

/// The reading of a surface's odometer.
///
/// Two readings of one odometer bound the distance that any vertex moved between them.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionReading {
    tree: u32,
    /// Number of an unbroken sequence of measurements; no two sequences share one.
    run: u32,
    /// Length along the path through all frames, in the tree's units.
    displacement: u64,
    /// Distance of an extrapolated surface from that path; 0 for a frame.
    residual: u32,
    /// The extrapolated surface's step from the previous frame.
    prediction: Prediction,
}

/// Equality ignores the prediction.
impl PartialEq for MotionReading {
    fn eq(&self, other: &Self) -> bool {
        let reading =
            |motion: &Self| (motion.tree, motion.run, motion.displacement, motion.residual);
        reading(self) == reading(other)
    }
}

impl Eq for MotionReading {}

impl MotionReading {
    /// Upper bound on the motion of any vertex since an earlier reading, in the tree's [`Unit`]; `None` if the motion
    /// was not measured over the whole time.
    #[inline]
    pub(crate) fn since(&self, before: &Self) -> Option<u64> {
        if self.tree != before.tree || self.run != before.run {
            return None;
        }
        let along = self.displacement.abs_diff(before.displacement);
        if along == 0 {
            return Some(self.residual.abs_diff(before.residual).into());
        }
        let residuals = u64::from(self.residual) + u64::from(before.residual);
        let farthest = along.saturating_add(residuals);
        match self
            .prediction
            .since(self.displacement.wrapping_sub(before.displacement), before.residual)
        {
            Some(units) if units < farthest => Some(units),
            _ => Some(farthest),
        }
    }

    /// Units from an earlier reading of a frame to this one; `None` if the motion was not measured over the whole time.
    pub(super) fn after(&self, before: &Self) -> Option<u64> {
        let is_one_run = self.tree == before.tree && self.run == before.run;
        if is_one_run { self.displacement.checked_sub(before.displacement) } else { None }
    }

    /// The reading at the start of an unbroken sequence of measurements.
    pub(crate) fn start(tree: u32) -> Self {
        Self { tree, run: next_run(), displacement: 0, residual: 0, prediction: Prediction::NONE }
    }

    /// The reading of a frame as words, for its label.
    pub(super) fn to_words(self) -> [u32; MotionReading::WORDS] {
        [self.tree, self.run, self.displacement as u32, (self.displacement >> 32) as u32]
    }

    /// The inverse of [`to_words`](Self::to_words). Memory that was never written gives no reading.
    pub(super) fn from_words([tree, run, low, high]: [u32; MotionReading::WORDS]) -> Option<Self> {
        let displacement = u64::from(high) << 32 | u64::from(low);
        let start = Self { tree, run, displacement, residual: 0, prediction: Prediction::NONE };
        (run != NO_RUN).then_some(start)
    }

    /// Number of words of a frame's reading.
    pub(super) const WORDS: usize = 4;

    /// The reading after a step in which no vertex moved farther than `farthest` (squared, rounded to nearest); `None`
    /// if that is not finite.
    #[cfg(feature = "bus")]
    pub(crate) fn after_step(self, unit: &MotionUnit, farthest: f32) -> Option<Self> {
        let units = unit.unit.units_of_step(farthest)?;
        (self.tree == unit.tree).then(|| self.along(units))
    }

    /// A frame's reading, this many units farther along the path; a new start if they are too many to count.
    pub(crate) fn along(self, units: u64) -> Self {
        match self.displacement.checked_add(units) {
            Some(displacement) => Self { displacement, ..self },
            None => Self::start(self.tree),
        }
    }

    /// The reading of a surface this many units off the path; `None` if they are too many to count.
    pub(crate) fn beside(self, units: u64) -> Option<Self> {
        let residual = u32::try_from(units).ok()?;
        Some(Self { residual, ..self })
    }

    /// This reading for a surface extrapolated along a prediction.
    pub(crate) const fn on(self, prediction: Prediction) -> Self {
        Self { prediction, ..self }
    }
}

/// The unit of the odometer: a power of two times 2^-24, at most 2^-24 of the largest root sphere's radius.
///
/// Integers add without rounding, and wrap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unit {
    length: f32,
    inverse: f32,
}

impl Unit {
    pub(crate) const fn of<I: Index>(tree: &Tree<'_, I>) -> Self {
        const EXPONENT: u32 = 0xFF << 23;
        let mut radius = 0.0_f32;
        let mut root = 0;
        while root < tree.roots() {
            if let Some((_, own, _)) = tree.node(root)
                && own > radius
            {
                radius = own;
            }
            root += 1;
        }
        // Clamped, so that no product underflows or overflows. Written so that NaN becomes a number.
        let radius = larger(1e-20, radius);
        let radius = smaller(1e20, radius);
        let power = f32::from_bits(radius.to_bits() & EXPONENT);
        Self { length: power / 16_777_216.0, inverse: 16_777_216.0 / power }
    }

    /// A length in units, rounded down: 0 for NaN and below 0, at most [`FAR`].
    #[inline(always)]
    pub(crate) fn down(self, length: f32) -> u32 {
        let units = (length * self.inverse) as i32;
        let units = if units < FAR { units } else { FAR };
        if units > 0 { units as u32 } else { 0 }
    }

    /// A length in units, rounded up, at most about [`FAR`].
    #[inline(always)]
    pub(crate) fn up(self, length: f32) -> u32 {
        self.down(length).wrapping_add(1)
    }

    /// A length in units, rounded up, without an upper limit.
    fn units_of(self, length: f32) -> u64 {
        ((length * self.inverse) as u64).saturating_add(1)
    }

    /// The units of a step whose square was rounded to nearest, rounded up; `None` if it is not finite.
    fn units_of_step(self, squared: f32) -> Option<u64> {
        (squared < f32::INFINITY).then(|| self.units_of(length_of_step(squared)))
    }

    /// The length of this many units, rounded to the nearest f32.
    #[inline(always)]
    pub(crate) fn length(self, units: i32) -> f32 {
        units as f32 * self.length
    }
}

/// The unit in which the motion of one tree's surfaces is counted. Only a tree creates one.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "bus"), allow(dead_code, reason = "only a receiver counts with it"))]
pub struct MotionUnit {
    pub(crate) tree: u32,
    unit: Unit,
}

impl MotionUnit {
    pub(crate) const fn of<I: Index>(tree: &Tree<'_, I>) -> Self {
        Self { tree: tree.checksum(), unit: Unit::of(tree) }
    }

    /// The unit for rows whose vertices move this many times as far.
    #[cfg(feature = "nodes")]
    pub(crate) const fn times(self, amplification: f32) -> Self {
        let Unit { length, inverse } = self.unit;
        Self {
            unit: Unit { length: length / amplification, inverse: inverse * amplification },
            ..self
        }
    }

    /// The units of a step whose square was rounded to nearest, rounded up; `None` if it is not finite.
    #[cfg(feature = "bus")]
    pub(crate) fn units_of_step(&self, squared: f32) -> Option<u64> {
        self.unit.units_of_step(squared)
    }

    /// A length in units, rounded up.
    #[cfg(feature = "modes")]
    pub(crate) fn units_of(&self, length: f32) -> u64 {
        self.unit.units_of(length)
    }
}

/// Upper bound on the length of a step from its square, which was rounded to nearest.
fn length_of_step(squared: f32) -> f32 {
    // Differences and squares are rounded by a few parts in 2^24, and underflow below 1e-22.
    sqrt(squared) * (1.0 + 4.0 * f32::EPSILON) + 1e-20
}

/// Largest number of units counted for a length: more than 32 times the root sphere's radius.
pub(crate) const FAR: i32 = 1 << 30;

/// A table of positions, with its surface's [`Odometer`] reading.
///
/// It borrows the table, so that measured positions cannot change.
#[derive(Debug)]
pub struct MovingTable<'v, V: ?Sized> {
    pub(super) table: &'v V,
    pub(super) motion: MotionReading,
}

impl<V: ?Sized> Clone for MovingTable<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V: ?Sized> Copy for MovingTable<'_, V> {}

impl<V: VertexTable + ?Sized> VertexTable for MovingTable<'_, V> {
    fn len(&self) -> usize {
        self.table.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.table.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        self.table.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.table.stretch()
    }

    fn position_error(&self) -> f32 {
        self.table.position_error()
    }
}

impl<V: VertexTable + ?Sized> MovingSurface for MovingTable<'_, V> {
    fn motion(&self) -> Option<MotionReading> {
        Some(self.motion)
    }
}

/// Measures how far a surface moves from one frame to the next.
///
/// Only a measurement of consecutive frames creates a [`MotionReading`]. If `before` is not the last measured frame, by
/// a digest of all its positions, the odometer restarts, and so do trackers.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{MotionReading, MovingSurface, Odometer, Tree};
///
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(320)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let [first, second] = [0, 1].map(|frame: usize| built.to_rows(&motion.frames[frame]));
///
/// let mut odometer = Odometer::new(&tree);
/// let before = odometer.start(first.as_slice());
/// let step = odometer.step(first.as_slice(), second.as_slice());
/// let reading: Option<MotionReading> = step.after().motion();
/// assert!(step.length() > 0.0 && reading != before.motion());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Odometer {
    unit: Unit,
    tree: u32,
    /// Number of rows in a frame.
    vertices: usize,
    surface: usize,
    motion: Option<MotionReading>,
    /// Digest of the last measured frame.
    digest: u64,
}

impl Odometer {
    /// An odometer for surfaces of this tree.
    #[must_use]
    pub const fn new<I: Index>(tree: &Tree<'_, I>) -> Self {
        Self {
            unit: Unit::of(tree),
            tree: tree.checksum(),
            vertices: tree.vertex_count() as usize,
            surface: tree.vertex_count() as usize,
            motion: None,
            digest: 0,
        }
    }

    /// An odometer for tables whose rows are not the surface's vertices, but move at least as far.
    #[cfg(feature = "nodes")]
    pub(crate) const fn of_rows(unit: MotionUnit, vertices: usize, surface: usize) -> Self {
        let MotionUnit { unit, tree } = unit;
        Self { unit, tree, vertices, surface, motion: None, digest: 0 }
    }

    /// Whether it measures this many rows in this unit: an odometer of a surface's vertices does not measure its nodes.
    #[cfg(feature = "nodes")]
    pub(crate) fn counts(&self, rows: usize, unit: MotionUnit) -> bool {
        let is_of_tree = self.tree == unit.tree && self.unit.length == unit.unit.length;
        is_of_tree && self.vertices == rows
    }

    /// Starts anew with a frame.
    ///
    /// Cost: one pass over the vertices.
    pub fn start<'v, V: VertexTable + ?Sized>(&mut self, surface: &'v V) -> MovingTable<'v, V> {
        self.motion = None;
        self.step(surface, surface).after()
    }

    /// Measures the step from `before`, which must be the last measured frame, to `after`. Otherwise the odometer
    /// restarts.
    ///
    /// Cost: one pass over the vertices of both, some 15 floating point operations each.
    pub fn step<'v, V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
        &mut self,
        before: &'v W,
        after: &'v V,
    ) -> Step<'v, W, V> {
        self.step_of(before, after, |_| true)
    }

    /// The same by the motion of the rows that carry a part of the surface.
    pub(crate) fn step_of<'v, V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
        &mut self,
        before: &'v W,
        after: &'v V,
        carries: impl Fn(u32) -> bool,
    ) -> Step<'v, W, V> {
        let (mut from, mut to) = (Digest::new(), Digest::new());
        let mut largest = 0.0_f32;
        let mut is_measured = before.len() == self.vertices && after.len() == self.vertices;
        for vertex in 0..self.vertices as u32 {
            let (Some(old), Some(new)) = (before.position(vertex), after.position(vertex)) else {
                is_measured = false;
                break;
            };
            from.add(vertex, old);
            to.add(vertex, new);
            let squared = new.distance_squared(old);
            if squared > largest && carries(vertex) {
                largest = squared;
            }
            // False for NaN too.
            is_measured &= squared < f32::INFINITY;
        }
        let length = length_of_step(largest);
        let units = self.unit.units_of_step(largest).unwrap_or(0);
        let start = || MotionReading::start(self.tree);
        let from_last = self.motion.filter(|_| self.digest == from.0).unwrap_or_else(start);
        let (from, units) = if is_measured { (from_last, units) } else { (start(), 0) };
        let motion = from.along(units);
        self.digest = to.0;
        self.motion = Some(motion);
        Step { before, after, from, motion, units, is_measured, length }
    }
}

/// No sequence has this number.
const NO_RUN: u32 = 0;

/// A new number for a sequence of measurements.
fn next_run() -> u32 {
    static NEXT: AtomicU32 = AtomicU32::new(NO_RUN + 1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// Digest of a frame: a product of 128 bits for each vertex, folded, as in wyhash.
///
/// A multiplication alone moves no bit downwards, so two flipped signs would cancel: a mirrored or half-turned frame
/// would have the same digest. Both factors depend on the vertex, so no change of one is undone by a fixed change of
/// another. Two different frames have the same digest with a probability of 2^-64.
struct Digest(u64);

impl Digest {
    /// Digits of pi. No vertex has the second one's upper half as its number, so that factor is never 0.
    const KEYS: [u64; 2] = [0x243F_6A88_85A3_08D3, 0xA409_3822_299F_31D0];

    const fn new() -> Self {
        Self(0x1319_8A2E_0370_7344)
    }

    #[inline(always)]
    fn add(&mut self, vertex: u32, position: Vec3) {
        let [x, y, z] = position.to_array().map(|axis| u64::from(axis.to_bits()));
        let [first, second] = Self::KEYS;
        let factor = self.0 ^ (x << 32 | y) ^ first;
        let product = u128::from(factor) * u128::from((u64::from(vertex) << 32 | z) ^ second);
        // The rotated state keeps what a factor of 0 would erase.
        self.0 = self.0.rotate_left(29) ^ (product >> 64) as u64 ^ product as u64;
    }
}

#[cfg(test)]
mod tests;

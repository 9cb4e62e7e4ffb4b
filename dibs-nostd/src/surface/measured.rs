//! The measured stretch of one frame.

// Requirement: F-04

use crate::math::order::larger;
use crate::tree::TriangleRow;

/// Number of regions of a surface with their own measured stretch: equal ranges of triangle rows, which are patches of
/// the surface because rows are sorted by leaf.
pub const REGIONS: usize = 32;

/// How it is known that the tree's spheres cover the surface, so that no part of it is nearer than the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Coverage {
    /// The stretch was measured on these positions.
    Measured,
    /// A bound on the stretch follows from measured frames: between two of them, or from a modal surface's weights.
    Proven,
    /// Nothing was measured: the tree's stretch limit is assumed to hold. If it does not, a nearer part of the surface
    /// may be missed. [`measure_stretch`](crate::measure_stretch) checks a frame.
    Assumed,
}

impl Coverage {
    /// The coverage of an answer from two surfaces: the weaker.
    #[must_use]
    pub const fn or_weaker(self, other: Self) -> Self {
        match (self, other) {
            (Self::Assumed, _) | (_, Self::Assumed) => Self::Assumed,
            (Self::Proven, _) | (_, Self::Proven) => Self::Proven,
            (Self::Measured, Self::Measured) => Self::Measured,
        }
    }
}

/// The largest stretch `sigma` of one frame, over all triangles, and that of each region.
///
/// Only a measurement creates one, so a query cannot get a stretch below the true one by mistake. A query refuses a
/// measurement of another tree or, if known, of another frame.
///
/// If triangles have their own limits, a triangle's stretch is divided by its limit and multiplied by the tree's, like
/// the tree's radii.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MeasuredStretch {
    sigma: f32,
    tree: u32,
    /// The most stretched triangle, and the flag [`PROVEN`].
    triangle: u32,
    epoch: Option<u32>,
    /// Each region's stretch, less one, in 256ths of `sigma`.
    regions: [u8; REGIONS],
}

impl MeasuredStretch {
    /// A measurement of the frame `epoch` with the tree of this checksum, and the code of each [region's
    /// stretch](region_sigma).
    pub(crate) const fn new(
        sigma: f32,
        tree: u32,
        triangle: u32,
        epoch: Option<u32>,
        regions: [u8; REGIONS],
    ) -> Self {
        Self { sigma, tree, triangle, epoch, regions }
    }

    /// One bound for the whole surface, not from a measurement of every triangle.
    #[cfg(feature = "modes")]
    pub(crate) const fn everywhere(sigma: f32, tree: u32, triangle: u32) -> Self {
        let regions = [u8::MAX; REGIONS];
        Self { sigma, tree, triangle: triangle | PROVEN, epoch: None, regions }
    }

    /// A bound for two frames of one surface and all surfaces between them: gradients are linear in the positions, and
    /// the largest singular value (or edge) is convex. `None` if they were measured with different trees.
    #[must_use]
    pub fn or_larger(self, other: Self) -> Option<Self> {
        self.of_both(other, larger(self.sigma, other.sigma))
    }

    /// A bound for a surface computed from two measured ones; `None` if measured with different trees.
    pub(crate) fn of_both(self, other: Self, sigma: f32) -> Option<Self> {
        let larger = if other.sigma > self.sigma { other } else { self };
        let regions = [u8::MAX; REGIONS];
        let triangle = larger.triangle | PROVEN;
        let both = Self { sigma, triangle, epoch: None, regions, ..larger };
        (self.tree == other.tree).then_some(both)
    }

    /// The largest stretch, rounded up: at least 1 if any length was kept, and never below a half.
    #[must_use]
    pub const fn sigma(&self) -> f32 {
        self.sigma
    }

    /// The largest stretch of each region, rounded up to a 256th of [`sigma`](Self::sigma). A frame's label stores only
    /// `sigma`.
    #[must_use]
    pub fn regions(&self) -> [f32; REGIONS] {
        self.regions.map(|code| region_sigma(self.sigma, code))
    }

    /// The most stretched triangle.
    #[must_use]
    pub const fn triangle(&self) -> TriangleRow {
        TriangleRow(self.triangle & !PROVEN)
    }

    /// Checksum of the tree used for the measurement.
    #[must_use]
    pub const fn tree(&self) -> u32 {
        self.tree
    }

    /// Number of the measured frame, if it has one.
    #[must_use]
    pub const fn epoch(&self) -> Option<u32> {
        self.epoch
    }

    /// Whether the frame itself was measured, or the bound follows from other frames.
    #[must_use]
    pub const fn coverage(&self) -> Coverage {
        if self.triangle & PROVEN != 0 { Coverage::Proven } else { Coverage::Measured }
    }

    /// The measurement as words, without its epoch and its regions, for the frame's label.
    pub(crate) const fn to_words(self) -> [u32; MeasuredStretch::WORDS] {
        [self.sigma.to_bits(), self.tree, self.triangle]
    }

    pub(crate) const fn from_words(
        [sigma, tree, triangle]: [u32; MeasuredStretch::WORDS],
        epoch: u32,
    ) -> Self {
        Self::new(f32::from_bits(sigma), tree, triangle, Some(epoch), [u8::MAX; REGIONS])
    }

    pub(crate) const WORDS: usize = 3;
}

/// Flag in the triangle's number: the bound was not measured on the frame itself. No tree has so many triangles.
const PROVEN: u32 = 1 << 31;

/// The stretch that a region's code encodes.
pub(crate) fn region_sigma(sigma: f32, code: u8) -> f32 {
    sigma * ((f32::from(code) + 1.0) * (1.0 / 256.0))
}

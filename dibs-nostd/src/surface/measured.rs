//! The measured stretch of one frame, as it travels with the frame.

use crate::tree::TriangleRow;

/// Regions that a surface is divided into for its measured stretch: equal runs of triangle rows, which
/// are patches of the surface because rows stand leaf by leaf.
pub const REGIONS: usize = 32;

/// The stretch `sigma` of one frame, measured on every triangle: the largest, and that of each region.
///
/// Only a measurement makes one, so a query cannot be given a stretch below the true one by mistake.
/// It belongs to the tree and, where that is known, to the frame that it was measured on; a query
/// refuses another's.
///
/// Where triangles have limits of their own, a stretch counts as the part of its limit that it takes,
/// times the tree's limit: the tree's radii grow with that.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MeasuredStretch {
    sigma: f32,
    tree: u32,
    triangle: u32,
    epoch: Option<u32>,
    /// Each region's share of `sigma`, less one, in parts of 256.
    regions: [u8; REGIONS],
}

impl MeasuredStretch {
    /// A measurement of the frame `epoch` with the tree of this checksum: of each region the code of its
    /// [`share`].
    pub(crate) const fn new(
        sigma: f32,
        tree: u32,
        triangle: u32,
        epoch: Option<u32>,
        regions: [u8; REGIONS],
    ) -> Self {
        Self { sigma, tree, triangle, epoch, regions }
    }

    /// One bound for the whole surface, by other means than measuring every triangle.
    #[cfg(feature = "modes")]
    pub(crate) const fn everywhere(sigma: f32, tree: u32, triangle: u32) -> Self {
        Self { sigma, tree, triangle, epoch: None, regions: [u8::MAX; REGIONS] }
    }

    /// A bound for two frames of one surface and all between them: gradients are linear in the positions, and
    /// the largest singular value (or edge) is convex. `None` if they were measured with different trees.
    #[must_use]
    pub fn or_larger(self, other: Self) -> Option<Self> {
        let larger = if other.sigma > self.sigma { other } else { self };
        let regions = [u8::MAX; REGIONS];
        (self.tree == other.tree).then_some(Self { epoch: None, regions, ..larger })
    }

    /// The largest stretch, rounded up: at least 1 where anything kept its length, and never below a
    /// half.
    #[must_use]
    pub const fn sigma(&self) -> f32 {
        self.sigma
    }

    /// The largest stretch of each region, rounded up to a 256th of [`sigma`](Self::sigma).
    #[must_use]
    pub fn regions(&self) -> [f32; REGIONS] {
        self.regions.map(|code| share(self.sigma, code))
    }

    /// The triangle that is stretched most.
    #[must_use]
    pub const fn triangle(&self) -> TriangleRow {
        TriangleRow(self.triangle)
    }

    /// Checksum of the tree that it was measured with.
    #[must_use]
    pub const fn tree(&self) -> u32 {
        self.tree
    }

    /// Number of the frame that it was measured on, where the frame has one.
    #[must_use]
    pub const fn epoch(&self) -> Option<u32> {
        self.epoch
    }

    /// The measurement as words, without its epoch: for the frame that it is kept with.
    pub(crate) fn to_words(self) -> [u32; MeasuredStretch::WORDS] {
        let mut words = [0; Self::WORDS];
        let [sigma, tree, triangle, regions @ ..] = &mut words;
        (*sigma, *tree, *triangle) = (self.sigma.to_bits(), self.tree, self.triangle);
        let (codes, _) = self.regions.as_chunks::<4>();
        for (word, codes) in regions.iter_mut().zip(codes) {
            *word = u32::from_le_bytes(*codes);
        }
        words
    }

    /// The inverse of [`to_words`](Self::to_words).
    pub(crate) fn from_words(words: &[u32; Self::WORDS], epoch: u32) -> Self {
        let [sigma, tree, triangle, packed @ ..] = words;
        let mut regions = [0; REGIONS];
        let (codes, _) = regions.as_chunks_mut::<4>();
        for (codes, word) in codes.iter_mut().zip(packed) {
            *codes = word.to_le_bytes();
        }
        let sigma = f32::from_bits(*sigma);
        Self { sigma, tree: *tree, triangle: *triangle, epoch: Some(epoch), regions }
    }

    /// Words that a measurement takes.
    pub(crate) const WORDS: usize = 3 + REGIONS / 4;
}

/// Stretch that a region's code stands for.
pub(crate) fn share(sigma: f32, code: u8) -> f32 {
    sigma * ((f32::from(code) + 1.0) * (1.0 / 256.0))
}

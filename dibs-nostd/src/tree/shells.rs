//! The shells of a tree: surfaces that share no vertex, with one root each, and the solids that they bound.
//!
//! A closed shell that faces outwards bounds a solid; shells that face inwards and lie in it at rest are its cavities.
//! Open surfaces bound no solid.

// Requirements: A-08, S-02

use super::format::{self, SOLID_BYTES, section};
use super::{FormatError, Tree};
use crate::Index;

/// The solid of an open surface, which bounds none.
pub(crate) const OPEN: u32 = u32::MAX;

/// A set of a tree's roots: one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RootSet(u64);

impl RootSet {
    /// All roots.
    pub const ALL: Self = Self(u64::MAX);

    /// One root.
    pub const fn of(root: u32) -> Self {
        Self(1_u64.wrapping_shl(root))
    }

    #[inline(always)]
    pub const fn contains(self, root: u32) -> bool {
        self.0.wrapping_shr(root) & 1 != 0
    }

    /// The lowest root.
    #[inline(always)]
    pub const fn first(self) -> u32 {
        self.0.trailing_zeros()
    }

    /// A number that distinguishes the shells of one solid, or all shells, from others.
    pub const fn key(self) -> u32 {
        if self.0 == Self::ALL.0 { u32::MAX } else { self.first() }
    }

    const fn with(self, root: u32) -> Self {
        Self(self.0 | Self::of(root).0)
    }
}

impl<I: Index> Tree<'_, I> {
    /// The first triangle of a root, and the root of its solid's outer shell.
    const fn shell(&self, root: u32) -> Option<(u32, u32)> {
        let at = (root as usize).saturating_mul(SOLID_BYTES);
        match (
            format::u32_at(self.sections.solids, at),
            format::u32_at(self.sections.solids, at.saturating_add(4)),
        ) {
            (Some(first), Some(solid)) => Some((first, solid)),
            _ => None,
        }
    }

    pub(crate) fn root_of(&self, triangle: u32) -> u32 {
        let mut found = 0;
        for root in 1..=self.header.other_roots {
            match self.shell(root) {
                Some((first, _)) if first <= triangle => found = root,
                _ => break,
            }
        }
        found
    }

    /// The root of the outer shell of the solid that a root's shell bounds; `None` if that is open.
    pub(crate) fn solid_of(&self, root: u32) -> Option<u32> {
        match self.shell(root) {
            Some((_, solid)) if solid != OPEN => Some(solid),
            _ => None,
        }
    }

    /// The shells that together decide the side of a point whose closest sheet belongs to a root: those of its solid.
    /// An open surface decides where it is the closest of all.
    pub(crate) fn shells_of(&self, root: u32) -> RootSet {
        let Some(solid) = self.solid_of(root) else { return RootSet::ALL };
        let mut shells = RootSet::of(solid);
        for other in 0..=self.header.other_roots {
            if self.solid_of(other) == Some(solid) {
                shells = shells.with(other);
            }
        }
        shells
    }
}

/// Checks that a tree with sides has the section if it has several roots, that first triangles ascend, and that each
/// cavity's solid is another shell's own.
pub(super) const fn check<I: Index>(tree: &Tree<'_, I>) -> Result<(), FormatError> {
    const ERROR: FormatError = FormatError::Section { kind: section::SOLIDS };
    if tree.header.other_roots == 0 || !tree.has_adjacency() {
        return if tree.sections.solids.is_empty() { Ok(()) } else { Err(ERROR) };
    }
    let (mut root, mut least) = (0, 0);
    while root <= tree.header.other_roots {
        let Some((first, solid)) = tree.shell(root) else { return Err(ERROR) };
        let is_in_order = if root == 0 { first == 0 } else { first >= least };
        if !is_in_order || first >= tree.header.triangles {
            return Err(ERROR);
        }
        if solid != OPEN {
            match tree.shell(solid) {
                Some((_, own)) if own == solid => (),
                _ => return Err(ERROR),
            }
        }
        least = first + 1;
        root += 1;
    }
    Ok(())
}

//! A part of the surface that tools must stay farther from than from the rest: the triangles of a label.
//!
//! It is one more surface for each tool, thickened by the difference of the stand-offs. A nearer label with a smaller
//! stand-off does not hide it, because only its own triangles are searched. Where the tool is not certainly outside of
//! the whole surface, the whole surface's own stand-off keeps the tool out; a part has no side of its own.

use super::Filter;

/// A label, and by how much (mm) its stand-off is larger than the filter's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub label: u8,
    pub more: f32,
}

impl<const LABELS: usize> Filter<LABELS> {
    /// The parts whose stand-off is larger than the filter's.
    pub(super) fn parts(&self) -> impl Iterator<Item = Part> {
        self.of_labels.iter().copied().filter(|part| part.more > 0.0)
    }

    /// What a tool is kept out of: the whole surface, and then each of these parts.
    pub(super) fn layers(&self) -> impl Iterator<Item = Option<Part>> {
        core::iter::once(None).chain(self.parts().map(Some))
    }
}

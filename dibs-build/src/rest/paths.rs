//! The lines on the surface that count as paths.

use dibs_nostd::format::PathKind;

/// The paths that along-surface distances are measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// Mesh edges only, as in the paper. The tree's limit is on the stretch of each edge.
    Edges,
    /// Mesh edges and chords across up to this many edges (1: pairs of triangles). The tree's limit is on the largest
    /// singular value of each triangle.
    Surface {
        /// Most edges that a chord crosses.
        crossings: u32,
    },
}

impl Paths {
    /// The kind that the tree stores.
    pub(crate) const fn kind(self) -> PathKind {
        match self {
            Self::Edges => PathKind::EdgePath,
            Self::Surface { .. } => PathKind::Surface,
        }
    }
}

impl Default for Paths {
    /// The paths of the default construction.
    fn default() -> Self {
        Self::Surface { crossings: 3 }
    }
}

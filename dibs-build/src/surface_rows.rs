//! The surface's vertices in one frame: those of the frame itself, or computed from its nodes.

use dibs_nostd::nodes::{Nodes, NodesError};
use dibs_nostd::{
    Index, MeasuredStretch, PathKind, StretchError, Tree, VertexTable, measure_stretch,
};
use glam::Vec3;

use crate::frames::numbers;

/// The vertices of a tree's surface in one frame, in the order of its rows, and how far it is stretched. For a tree
/// with [nodes](dibs_nostd::nodes) a frame holds the nodes' positions, and every vertex is computed from them.
#[derive(Clone, Debug)]
pub struct SurfaceRows {
    positions: Vec<Vec3>,
    error: f32,
    /// The measured stretch, or why it cannot be measured.
    pub stretch: Result<MeasuredStretch, StretchError>,
}

impl SurfaceRows {
    /// The surface of a frame whose rows are in the order that [`FrameCheck`](crate::FrameCheck) returns.
    ///
    /// # Errors
    /// [`NodesError`] where the tree's nodes are damaged.
    pub fn of<I: Index>(tree: &Tree<'_, I>, frame: Vec<Vec3>) -> Result<Self, NodesError> {
        if tree.paths() != PathKind::Volume {
            let stretch = measure_stretch(tree, frame.as_slice());
            return Ok(Self { positions: frame, error: 0.0, stretch });
        }
        let nodes = Nodes::of(tree)?;
        let surface = nodes.surface(frame.as_slice());
        let positions = (0..surface.len() as u32).filter_map(|row| surface.position(row)).collect();
        let error = surface.position_error();
        Ok(Self { positions, error, stretch: nodes.measure(frame.as_slice()) })
    }

    /// The rest shape as a frame; `None` if the tree has none.
    #[must_use]
    pub fn rest_frame<I: Index>(tree: &Tree<'_, I>) -> Option<Vec<Vec3>> {
        match Nodes::of(tree) {
            Ok(nodes) => (0..nodes.count()).map(|node| nodes.rest_position(node)).collect(),
            Err(_) => (0..tree.vertex_count()).map(|row| tree.rest_position(row)).collect(),
        }
    }

    /// The message for a frame that [`stretch`](Self::stretch) refuses: the error, and `remedy`, the user's way to allow
    /// more stretch, where that helps. No limit admits an inverted element: there the message names its nodes instead,
    /// by their numbers in the volume's file.
    #[must_use]
    pub fn refusal<I: Index>(tree: &Tree<'_, I>, error: StretchError, remedy: &str) -> String {
        let element = match error {
            StretchError::Inverted { element } => element,
            StretchError::Exceeded { .. } | StretchError::ElementExceeded { .. } => {
                return format!("{error}; {remedy}");
            }
            _ => return error.to_string(),
        };
        let nodes = Nodes::of(tree).ok().and_then(|nodes| nodes.element(element));
        let nodes = nodes.map_or_else(String::new, |nodes| format!(" (nodes {})", numbers(&nodes)));
        format!(
            "element {element}{nodes} is inverted or flat: no stretch limit admits that, mend the frame"
        )
    }

    /// The positions of the vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }
}

impl VertexTable for SurfaceRows {
    fn len(&self) -> usize {
        self.positions.len()
    }

    #[inline]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.positions.get(vertex as usize).copied()
    }

    fn position_error(&self) -> f32 {
        self.error
    }
}

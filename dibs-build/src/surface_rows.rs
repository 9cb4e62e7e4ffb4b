//! The surface's vertices in one frame: those of the frame itself, or computed from its nodes.

use dibs_nostd::nodes::{Nodes, NodesError};
use dibs_nostd::{
    Index, MeasuredStretch, PathKind, StretchError, Tree, VertexTable, measure_stretch,
};
use glam::Vec3;

use crate::frames::numbers;
use crate::nodes::own_limit;

/// The vertices of a tree's surface in one frame, in the order of its rows, and how far it is stretched. For a tree
/// with [nodes](dibs_nostd::nodes) a frame holds the nodes' positions, and every vertex is computed from them.
#[derive(Clone, Debug)]
pub struct SurfaceRows {
    positions: Vec<Vec3>,
    /// The nodes of the frame; empty if it has the vertices.
    nodes: Vec<Vec3>,
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
            return Ok(Self { positions: frame, nodes: Vec::new(), error: 0.0, stretch });
        }
        let nodes = Nodes::of(tree)?;
        let surface = nodes.surface(frame.as_slice());
        let positions = (0..surface.len() as u32).filter_map(|row| surface.position(row)).collect();
        let error = surface.position_error();
        let stretch = nodes.measure(frame.as_slice());
        Ok(Self { positions, nodes: frame, error, stretch })
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
    /// more stretch, where that helps. No limit admits an inverted element. An element is named by its nodes' numbers in
    /// the volume's file, and its stretch and limit are its own.
    #[must_use]
    pub fn refusal<I: Index>(tree: &Tree<'_, I>, error: StretchError, remedy: &str) -> String {
        let nodes = Nodes::of(tree).ok();
        let named = |element| match nodes.and_then(|nodes| nodes.element(element)) {
            Some(nodes) => format!("the element of the nodes {} (counted from 0)", numbers(&nodes)),
            None => format!("element {element}"),
        };
        match error {
            StretchError::Exceeded { .. } => format!("{error}; {remedy}"),
            StretchError::ElementExceeded { element, stretch, limit } => {
                let own = nodes.and_then(|nodes| own_limit(&nodes, element)).unwrap_or(limit);
                let of = named(element);
                // The error's stretch is multiplied by the tree's limit over the element's.
                let stretch = if own < limit { stretch * (own / limit) } else { stretch };
                format!("{of} is stretched by {stretch}, the tree allows {own}; {remedy}")
            }
            StretchError::Inverted { element } => {
                let of = named(element);
                format!("{of} is inverted or flat: no stretch limit admits that, mend the frame")
            }
            _ => error.to_string(),
        }
    }

    /// The frame that the surface is of: the nodes' positions for a tree with nodes, otherwise the vertices'.
    #[must_use]
    pub fn frame(&self) -> &[Vec3] {
        if self.nodes.is_empty() { &self.positions } else { &self.nodes }
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

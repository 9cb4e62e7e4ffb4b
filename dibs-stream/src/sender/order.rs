//! The mesh vertex, or the volume's node, of each row of the receiver's table.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Index, SurfaceFacts, Tree};

use super::SendError;
use dibs_build::FrameCheck;

/// A mesh, and the order in which its vertices are sent.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceOrder {
    pub(super) mesh_id: u32,
    pub(super) facts: SurfaceFacts,
    /// The mesh vertex of each row.
    order: Vec<u32>,
    /// The check of the tree that the order was made from; `None` if it was not made from a tree.
    check: Option<FrameCheck>,
}

impl SurfaceOrder {
    /// The order of a tree: the receiver's, or one built from the same mesh in the same way. For a tree with nodes it
    /// is the order of the nodes in the volume's file.
    #[must_use]
    pub fn of<I: Index>(tree: &Tree<'_, I>) -> Self {
        let check = FrameCheck::of(tree);
        let order = check.order().to_vec();
        // Rows of a frame: the tree's vertices, or its nodes.
        let facts = SurfaceFacts { vertices: order.len() as u32, ..tree.surface_facts() };
        Self { mesh_id: tree.mesh_id(), facts, order, check: Some(check) }
    }

    /// An order given by the mesh vertex of each row of the vertex table. Unit and triangles are unknown.
    #[must_use]
    pub fn new(mesh_id: u32, order: Vec<u32>) -> Self {
        let vertices = u32::try_from(order.len()).unwrap_or(0);
        let facts = SurfaceFacts { vertices, ..SurfaceFacts::default() };
        Self { mesh_id, facts, order, check: None }
    }

    /// Identity of the mesh.
    #[must_use]
    pub const fn mesh_id(&self) -> u32 {
        self.mesh_id
    }

    /// Rows of the vertex table.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.order.len()
    }

    /// Number of positions of a frame in the mesh's order: vertices of its file, or nodes. If the order was not made
    /// from a tree, the positions up to the last vertex that is sent.
    #[must_use]
    pub fn positions(&self) -> usize {
        let last = || self.order.iter().max().map_or(0, |&last| last as usize + 1);
        self.check.as_ref().map_or_else(last, FrameCheck::positions)
    }

    /// Corners of the tree's triangles, by the mesh's numbers. Empty if the order was not made from a tree, or holds
    /// nodes.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.check.as_ref().map_or(&[], FrameCheck::triangles)
    }

    /// Checks that the faces of a motion's files are those of the tree, if the order was made from a tree.
    ///
    /// # Errors
    /// [`SendError::Positions`] names the first triangle that is missing.
    pub fn check_faces(&self, faces: &[Vec<u32>]) -> Result<(), SendError> {
        let check = self.check.as_ref();
        Ok(check.map_or(Ok(()), |check| check.check_faces(faces))?)
    }

    /// Reorders positions from the mesh's order to the tree's rows.
    ///
    /// # Errors
    /// [`SendError::Positions`] if they are not a frame of the tree's surface; if the order was not made from a tree,
    /// [`SendError::Vertices`] if a vertex that is sent has no position.
    pub fn to_rows(&self, positions: &[Vec3]) -> Result<Vec<Vec3>, SendError> {
        let mut rows = Vec::new();
        self.to_rows_in(positions, &mut rows)?;
        Ok(rows)
    }

    /// The same, in memory that is reused.
    pub(super) fn to_rows_in(
        &self,
        positions: &[Vec3],
        rows: &mut Vec<Vec3>,
    ) -> Result<(), SendError> {
        rows.clear();
        if let Some(check) = &self.check {
            return Ok(check.to_rows_in(positions, rows)?);
        }
        let found = positions.len();
        if let Some(&vertex) = self.order.iter().find(|&&vertex| vertex as usize >= found) {
            return Err(SendError::Vertices { vertex, found });
        }
        rows.extend(self.order.iter().map(|&vertex| positions[vertex as usize]));
        Ok(())
    }
}

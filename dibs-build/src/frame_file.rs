//! A mesh file as a frame of a tree.

use std::path::Path;

use dibs_nostd::format::Unit;
use glam::{DVec3, Vec3};

use crate::frames::{FrameCheck, FrameError};
use crate::read::{self, ReadError, ReadErrorKind, ReadTarget};

impl FrameCheck {
    /// Reads a mesh file that is a frame: positions in the order of the tree's rows.
    ///
    /// # Errors
    /// [`ReadError`]. Also for a file with other vertices, triangles or size than the tree's mesh, or one that is
    /// inside out.
    pub fn read(
        &self,
        path: impl AsRef<Path>,
        unit: Option<Unit>,
        origin: DVec3,
    ) -> Result<Vec<Vec3>, ReadError> {
        let path = path.as_ref();
        let frame = || {
            let wanted = if self.is_of_nodes() { ReadTarget::Volume } else { ReadTarget::Surface };
            let (positions, faces) = read::frame(path, wanted, 0, unit, origin)?;
            let rows = self.to_rows(&positions);
            // The faces tell a frame of another mesh from one in another unit.
            if !matches!(rows, Err(FrameError::Vertices { .. } | FrameError::Nodes { .. })) {
                self.check_faces(&faces)?;
            }
            Ok(rows?)
        };
        frame().map_err(|kind: ReadErrorKind| ReadError { path: path.to_path_buf(), kind })
    }
}

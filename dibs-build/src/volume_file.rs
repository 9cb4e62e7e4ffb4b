//! Reads the file of a volume.

use std::path::Path;

use dibs_nostd::format::Unit;

use crate::nodes::Volume;
use crate::read::{self, ReadError};

impl Volume {
    /// Reads a volume of tetrahedra from a Gmsh (.msh) or VTK file (.vtk, .vtu) with lengths in `unit`: the nodes are
    /// converted to millimetres and keep the order of the file. `None` means millimetres, or the unit that the file
    /// states.
    ///
    /// # Errors
    /// [`ReadError`], one sentence that names the file, the offending element and the remedy.
    pub fn read(path: impl AsRef<Path>, unit: impl Into<Option<Unit>>) -> Result<Self, ReadError> {
        let (path, unit) = (path.as_ref(), unit.into());
        let volume = read::volume(path, unit)
            .and_then(|(nodes, tetrahedra)| Ok(Self::new(nodes, tetrahedra)?));
        volume.map_err(|kind| ReadError { path: path.to_path_buf(), kind })
    }
}

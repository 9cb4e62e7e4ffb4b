//! The real anatomy, which is beside the repository on some machines.

use std::path::PathBuf;

use xtask::workspace;

/// The folder of the real meshes, where it is.
pub fn real() -> Option<PathBuf> {
    let path = workspace::root().join("../shared/data");
    path.is_dir().then_some(path)
}

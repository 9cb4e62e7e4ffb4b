//! Real anatomical meshes, which some machines have beside the repository.

use std::path::PathBuf;

use xtask::workspace;

/// The folder of the real meshes, if present.
pub fn real() -> Option<PathBuf> {
    let path = workspace::root().join("../shared/data");
    path.is_dir().then_some(path)
}

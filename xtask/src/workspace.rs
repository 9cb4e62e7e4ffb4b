//! Folders of the workspace.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::process::run;

/// The repository's top folder: that of the package that cargo runs, of this program, or of the current folder. It is
/// determined at each start, so that a copy of the checkout, including its target folder, works on itself.
pub fn root() -> PathBuf {
    let starts = [
        env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from),
        env::current_exe().ok(),
        env::current_dir().ok(),
    ];
    let root = starts.iter().flatten().find_map(|start| root_above(start));
    root.map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// The top folder of the repository that a path is in.
pub fn root_above(start: &Path) -> Option<&Path> {
    let holds = |folder: &Path, package: &str| folder.join(package).join("Cargo.toml").is_file();
    start.ancestors().find(|folder| holds(folder, "xtask") && holds(folder, "dibs-nostd"))
}

/// The variable that tells tests and checks that [`build`] has run, so that they use its results.
const BUILT: &str = "DIBS_BUILT";

/// For the processes that run after [`build`].
pub const IS_BUILT: (&str, &str) = (BUILT, "1");

/// Whether [`build`] has run.
pub fn is_built() -> bool {
    env::var_os(BUILT).is_some()
}

/// Builds everything as the tests do: built separately, each would compile its dependencies again, with fewer features.
///
/// # Errors
/// If something does not compile.
pub fn build() -> Result<()> {
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--quiet", "--release", "--lib", "--bins", "--tests"]);
    run(cargo.current_dir(root()))
}

/// The variable that names another folder for the evidence.
pub const EVIDENCE: &str = "DIBS_EVIDENCE";

/// The folder of pages and records that programs write: `docs/evidence`, or in a run of `cargo xtask evidence` one of
/// its own.
pub fn evidence() -> PathBuf {
    env::var_os(EVIDENCE).map_or_else(|| root().join("docs/evidence"), PathBuf::from)
}

/// Cargo's target folder.
pub fn target() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

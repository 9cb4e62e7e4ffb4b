//! Python environments, and the package of this library in them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result};

use crate::process::quiet;
use crate::workspace;

const MOMENT: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(600);

/// The oldest Python that the package runs on.
const OLDEST: &str = "import sys; assert sys.version_info >= (3, 9), 'older than 3.9'";

/// A virtual environment with these packages. Returns its Python.
///
/// # Errors
/// If there is no suitable Python, or a package is unavailable.
pub fn environment(folder: &Path, packages: &[&str]) -> Result<PathBuf> {
    let mut python = Command::new("python3");
    quiet(python.args(["-c", OLDEST]), MOMENT).context("no Python that serves")?;
    let own = folder.join("bin/python");
    if quiet(Command::new(&own).args(["-m", "pip", "--version"]), MOMENT).is_err() {
        let mut make = Command::new("python3");
        quiet(make.args(["-m", "venv", "--clear"]).arg(folder), DOWNLOAD)
            .context("no virtual environment (Debian: python3-venv)")?;
    }
    install(&own, packages)?;
    Ok(own)
}

/// Installs packages into the environment of this Python, from wheels where there are any: some have none.
///
/// # Errors
/// If a package is unavailable.
pub fn install(python: &Path, packages: &[&str]) -> Result<()> {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.arg("--prefer-binary").args(packages);
    quiet(&mut pip, DOWNLOAD).context("Python packages cannot be had").map(drop)
}

/// Assembles the package from its Python part and the library of the workspace's build, because building a wheel would
/// compile the dependencies again. Returns the folder for `PYTHONPATH`.
///
/// # Errors
/// If something does not compile or cannot be copied.
pub fn package(folder: &Path) -> Result<PathBuf> {
    workspace::build()?;
    let package = folder.join("dibs");
    fs::create_dir_all(&package)?;
    for file in fs::read_dir(workspace::root().join("bindings/python/dibs"))? {
        let file = file?;
        if file.path().is_file() {
            fs::copy(file.path(), package.join(file.file_name()))?;
        }
    }
    let library = workspace::target().join("release/libdibs_python.so");
    fs::copy(&library, package.join("_dibs.abi3.so"))
        .with_context(|| format!("no {}", library.display()))?;
    Ok(folder.to_path_buf())
}

//! The controller in C: `examples/c/firmware`, compiled by Debian's cross compiler and linked with the C interface.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, anyhow};

use crate::process::{quiet, run};
use crate::toolchain::Cross;
use crate::{apt, c_interface, workspace};

const COMPILER: &str = "arm-none-eabi-gcc";
const PACKAGE: &str = "gcc-arm-none-eabi";

/// Finds the compiler, or installs it. Returns its version line.
pub fn find() -> Result<String> {
    version().or_else(|_| apt::install(&[PACKAGE]).and_then(|()| version())).map_err(|error| {
        anyhow!("no {COMPILER}: {error:#}; `sudo apt-get install {PACKAGE}` installs it")
    })
}

fn version() -> Result<String> {
    let text = quiet(Command::new(COMPILER).arg("--version"), Duration::from_secs(20))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// Builds the program for a tree with this number of vertices; it links only if the library has no panic path.
pub fn build(cross: &Cross, tree: &[u8], vertices: u32) -> Result<PathBuf> {
    let library = c_interface::build(cross, "")?;
    let sources = workspace::root().join("examples/c/firmware");
    let folder = workspace::target().join("c-firmware");
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("surface.dibs"), tree)?;
    let program = folder.join("firmware");
    let mut gcc = Command::new(COMPILER);
    // The options that a user would type; paths in them are relative to that folder.
    gcc.current_dir(&sources).arg("@flags").arg("-I").arg(&folder);
    gcc.arg(format!("-DSURFACE_VERTICES={vertices}"));
    gcc.args(names(&sources)?).arg(&library).arg("-o").arg(&program);
    run(&mut gcc).context("the firmware in C does not build")?;
    Ok(program)
}

fn names(sources: &Path) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(sources)?.collect::<std::io::Result<Vec<_>>>()?;
    let names = entries.iter().map(|entry| PathBuf::from(entry.file_name()));
    let is_source =
        |name: &PathBuf| name.extension().is_some_and(|kind| kind == "c" || kind == "S");
    let mut names: Vec<_> = names.filter(is_source).collect();
    names.sort();
    Ok(names)
}

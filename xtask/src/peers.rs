//! `cargo xtask peers`: runs `tests/peers`, which queries other libraries through their Python packages, in its own
//! environment.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;
use xtask::process::run;
use xtask::{python, workspace};

/// Installs the libraries, and runs the tests of the counting before anything is counted.
pub fn peers(arguments: &[String]) -> Result<()> {
    let folder = workspace::target().join("peers");
    let source = workspace::root().join("tests/peers");
    eprintln!("installing the libraries, the first time for some minutes ...");
    let python = python::environment(&folder.join("venv"), &["numpy"])?;
    install_each(&python, &source.join("requirements.txt"))?;
    let package = python::package(&folder.join("package"))?;
    let command = || {
        let mut command = Command::new(&python);
        command.env("PYTHONPATH", &package).env("PYTHONDONTWRITEBYTECODE", "1");
        command.args(["-W", "ignore"]);
        command
    };
    run(command().args(["-m", "unittest", "discover", "-s"]).arg(&source))?;
    run(command().arg(&source).arg("--folder").arg(folder.join("cases")).args(arguments))
}

/// Installs the libraries one by one if some are unavailable: the page says which are missing.
fn install_each(python: &Path, requirements: &Path) -> Result<()> {
    let lines = fs::read_to_string(requirements)?;
    let lines: Vec<&str> = lines.lines().filter(|line| !line.starts_with('#')).collect();
    if python::install(python, &lines).is_err() {
        for line in &lines {
            if let Err(error) = python::install(python, &[line]) {
                eprintln!("{line}: {error:#}");
            }
        }
    }
    Ok(())
}

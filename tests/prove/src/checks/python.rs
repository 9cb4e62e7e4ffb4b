//! The Python package's own tests, against trimesh, scipy and the program `dibs`.

// Requirement: P-07

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};
use xtask::process::run;
use xtask::python::{environment, package};
use xtask::steps::Outcome;
use xtask::workspace;

use crate::harness::figures::Figures;
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check { name: "python", run: check, promises: &[] };

fn check(effort: &Effort, _: &mut Figures) -> Result<Outcome> {
    let folder = workspace::target().join("python");
    let mut packages = vec!["numpy", "scipy", "trimesh", "cryptography", "mypy"];
    packages.extend(effort.is_record.then_some("maturin"));
    let python = match environment(&folder.join("venv"), &packages) {
        Ok(python) => python,
        Err(error) => return Ok(Outcome::Skipped(format!("{error:#}"))),
    };
    let source = workspace::root().join("bindings/python");
    let mut types = Command::new(&python);
    types.args(["-m", "mypy", "--strict", "--cache-dir"]).arg(folder.join("mypy"));
    types.args([source.join("dibs"), source.join("tests/misuse.py")]);
    run(types.env("MYPYPATH", &source))?;
    let mut tests = Command::new(&python);
    if effort.is_record {
        install_wheel(&python, &folder, &source)?;
    } else {
        tests.env("PYTHONPATH", package(&folder.join("package"))?);
    }
    tests.args(["-W", "ignore", "-m", "unittest", "discover", "-s"]).arg(source.join("tests"));
    tests.env("DIBS_PROGRAM", workspace::target().join("release/dibs"));
    // No files may be created beside the sources.
    run(tests.env("PYTHONDONTWRITEBYTECODE", "1")).map(|()| Outcome::Passed)
}

/// Builds the wheel as a user does, and installs it.
fn install_wheel(python: &Path, folder: &Path, source: &Path) -> Result<()> {
    let wheels = folder.join("wheels");
    if wheels.exists() {
        fs::remove_dir_all(&wheels)?;
    }
    let mut maturin = Command::new(python);
    maturin.args(["-m", "maturin", "build", "--release", "--locked", "--out"]).arg(&wheels);
    run(maturin.arg("--manifest-path").arg(source.join("Cargo.toml")))?;
    let built = fs::read_dir(&wheels)?.map(|file| Ok(file?.path())).collect::<Result<Vec<_>>>()?;
    ensure!(built.len() == 1, "{} wheels", built.len());
    let name = built[0].display().to_string();
    ensure!(name.contains("-abi3-"), "{name} serves one version of Python only");
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"]);
    run(pip.arg("--disable-pip-version-check").arg(&built[0]))
}

//! The Python package's own tests, against trimesh, scipy and the program `dibs`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use xtask::process::{quiet, run};
use xtask::steps::Outcome;
use xtask::workspace;

use crate::harness::figures::Figures;
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check { name: "python", run: check, promises: &[] };

const MOMENT: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(300);

/// The oldest Python that the package runs on.
const OLDEST: &str = "import sys; assert sys.version_info >= (3, 9), 'older than 3.9'";

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
        tests.env("PYTHONPATH", package(&folder.join("package"), &source)?);
    }
    tests.args(["-W", "ignore", "-m", "unittest", "discover", "-s"]).arg(source.join("tests"));
    tests.env("DIBS_PROGRAM", workspace::target().join("release/dibs"));
    // Nothing is left beside the sources.
    run(tests.env("PYTHONDONTWRITEBYTECODE", "1")).map(|()| Outcome::Passed)
}

/// A virtual environment with these packages. Returns its Python.
fn environment(folder: &Path, packages: &[&str]) -> Result<PathBuf> {
    let mut python = Command::new("python3");
    quiet(python.args(["-c", OLDEST]), MOMENT).context("no Python that serves")?;
    let own = folder.join("bin/python");
    if quiet(Command::new(&own).args(["-m", "pip", "--version"]), MOMENT).is_err() {
        let mut make = Command::new("python3");
        quiet(make.args(["-m", "venv", "--clear"]).arg(folder), DOWNLOAD)
            .context("no virtual environment (Debian: python3-venv)")?;
    }
    let mut pip = Command::new(&own);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.args(["--only-binary", ":all:"]).args(packages);
    quiet(&mut pip, DOWNLOAD).context("packages of the tests cannot be had")?;
    Ok(own)
}

/// Puts the package together from its Python half and the library of the workspace's build, which is there already: a
/// wheel would compile its dependencies anew.
fn package(folder: &Path, source: &Path) -> Result<PathBuf> {
    workspace::build()?;
    let package = folder.join("dibs");
    fs::create_dir_all(&package)?;
    for file in fs::read_dir(source.join("dibs"))? {
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

//! `cargo xtask viewer`: the page of `dibs view`, and its tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use xtask::process::{quiet, run};
use xtask::steps::Outcome;
use xtask::{apt, workspace};

const TARGET: &str = "wasm32-unknown-unknown";
const PAGE: &str = "dibs-viewer.html";
const MOMENT: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(180);

/// Writes the page of `dibs view`, and puts it beside the program.
#[derive(clap::Args)]
pub struct Options {
    /// Also opens it in Chromium: the numbers of `dibs query`, drag, sliders, replay.
    #[arg(long)]
    test: bool,
    /// Also writes the measured times and the picture in docs/.
    #[arg(long, requires = "test")]
    record: bool,
}

/// Builds the page and, if requested, tests it.
pub fn viewer(options: &Options) -> Result<()> {
    let folder = session()?;
    programs(&[("node", "nodejs"), ("npm", "npm")])?;
    let own = workspace::root().join("viewer");
    say("fetching the page's libraries");
    let mut npm = Command::new("npm");
    run(npm.args(["ci", "--no-audit", "--no-fund"]).current_dir(&own))?;
    say("bundling the page");
    run(Command::new("node").arg(own.join("build.mjs")).arg(&folder))?;
    let page = workspace::target().join("viewer").join(PAGE);
    copy_whole(&folder.join(PAGE), &page)?;
    println!("{}", page.display());
    // Beside every build of `dibs`, because `dibs view` looks there.
    for profile in ["release", "debug"] {
        let beside = workspace::target().join(profile);
        if beside.is_dir() {
            copy_whole(&page, &beside.join(PAGE))?;
        }
    }
    if options.test {
        programs(&[("chromium", "chromium")])?;
        let mut test = Command::new("node");
        test.arg(own.join("test/browser.mjs")).arg(subject()?);
        if options.record {
            test.arg("--record");
        }
        run(&mut test)?;
    }
    Ok(())
}

/// Checks that the session compiles for WebAssembly: this stands for the viewer in CI, whose tests run on request.
pub fn compiles() -> Result<Outcome> {
    if let Err(error) = add_target() {
        return Ok(Outcome::Skipped(format!("{error:#}")));
    }
    let mut cargo = Command::new("cargo");
    cargo.args([
        "check",
        "--quiet",
        "--release",
        "--package",
        "dibs-view",
        "--lib",
        "--target",
        TARGET,
    ]);
    run(cargo.current_dir(workspace::root())).map(|()| Outcome::Passed)
}

/// The query compiled to WebAssembly answers as the native one, in Node.
pub fn same_bits() -> Result<Outcome> {
    if let Err(error) = programs(&[("node", "nodejs")]) {
        return Ok(Outcome::Skipped(format!("{error:#}")));
    }
    let folder = session()?;
    let test = workspace::root().join("viewer/test/bits.mjs");
    run(Command::new("node").arg(test).arg(&folder).arg(subject()?)).map(|()| Outcome::Passed)
}

/// Compiles the session to WebAssembly. Returns the folder with it and its JavaScript half.
fn session() -> Result<PathBuf> {
    add_target()?;
    let cargo = |arguments: &[&str]| {
        let mut cargo = Command::new("cargo");
        run(cargo.args(arguments).current_dir(workspace::root()))
    };
    say("compiling the query for WebAssembly, the first time for some minutes");
    let package = ["--quiet", "--package", "dibs-view"];
    let to_wasm = ["build", "--lib", "--release", "--target", TARGET];
    cargo(&[&to_wasm[..], &package].concat())?;
    let folder = workspace::target().join("viewer/page");
    fs::create_dir_all(&folder)?;
    let wasm = workspace::target().join(TARGET).join("release/dibs_view.wasm");
    let paths = [text(&wasm)?, text(&folder)?];
    let bindgen = ["run", "--release", "--features", "bindgen", "--bin", "bindgen"];
    cargo(&[&bindgen[..], &package, &["--", paths[0], paths[1]]].concat())?;
    Ok(folder)
}

/// A folder with `dibs` and its heart: `heart.dibs`, `heart.pc2`.
fn subject() -> Result<PathBuf> {
    let folder = workspace::target().join("viewer/heart");
    fs::create_dir_all(&folder)?;
    workspace::build()?;
    let dibs = workspace::target().join("release/dibs");
    let tasks = [
        "generate heart --triangles 10272 -o heart.ply --motion heart.pc2",
        "stretch heart.ply --motion heart.pc2 --margin 0.1 --limits heart.limits",
        "build heart.ply -o heart.dibs --limits heart.limits --motion heart.pc2",
    ];
    for task in tasks {
        quiet(Command::new(&dibs).args(task.split(' ')).current_dir(&folder), DOWNLOAD)?;
    }
    Ok(folder)
}

fn add_target() -> Result<()> {
    let mut list = Command::new("rustup");
    let installed = quiet(list.args(["target", "list", "--installed"]), MOMENT).unwrap_or_default();
    if installed.lines().any(|line| line == TARGET) {
        return Ok(());
    }
    quiet(Command::new("rustup").args(["target", "add", TARGET]), DOWNLOAD)
        .with_context(|| format!("the viewer needs Rust for {TARGET}: rustup target add {TARGET}"))
        .map(drop)
}

/// Installs the Debian packages of programs that are missing.
fn programs(needed: &[(&str, &str)]) -> Result<()> {
    for &(program, package) in needed {
        let is_here = || quiet(Command::new(program).arg("--version"), MOMENT).is_ok();
        if is_here() {
            continue;
        }
        apt::install(&[package])
            .with_context(|| format!("`{program}` is missing: install Debian's {package}"))?;
        if !is_here() {
            bail!("`{program}` does not start, although {package} is installed");
        }
    }
    Ok(())
}

/// Prints what is being done.
fn say(what: &str) {
    eprintln!("{what} ...");
}

/// Copies a file so that a partial copy is never visible.
fn copy_whole(from: &Path, to: &Path) -> Result<()> {
    let part = to.with_extension(format!("{}.part", std::process::id()));
    fs::copy(from, &part)?;
    fs::rename(&part, to).with_context(|| format!("{}: cannot be written", to.display()))
}

fn text(path: &Path) -> Result<&str> {
    path.to_str().with_context(|| format!("{}: not a name in UTF-8", path.display()))
}

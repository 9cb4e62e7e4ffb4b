//! How much longer a crate takes to compile for the tree that it includes, and a build script for its tree.
//!
//! `cargo bench -p dibs-tests --bench compile_time -- --write` writes `docs/compile-time.md`. The times are those of
//! the machine that runs it; nothing asserts them. `DIBS_FOLDER` keeps the compiled dependencies for the next run.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use std::{env, fs};

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, BuiltTree, generate};

const REPEATS: usize = 5;

fn main() -> Result<()> {
    let temporary = tempfile::tempdir()?;
    let folder = env::var_os("DIBS_FOLDER").map(PathBuf::from);
    let folder = folder.as_deref().unwrap_or(temporary.path());
    let empty = Crate::new(folder, "empty", None)?;
    let mut rows = String::new();
    let [check, release] = empty.times()?;
    row(&mut rows, "without a tree", 0, [check, release]);
    let sizes = env::var("DIBS_TRIANGLES").unwrap_or_else(|_| "10000 100000".to_owned());
    for triangles in sizes.split_whitespace() {
        let triangles = triangles.parse().context("DIBS_TRIANGLES")?;
        let start = Instant::now();
        let built = Builder::new().build(&generate::heart(triangles)?.mesh)?;
        eprintln!("{triangles} triangles built in {:.1} s", start.elapsed().as_secs_f64());
        let name = format!("{triangles} triangles");
        let times = Crate::new(folder, &format!("t{triangles}"), Some(&built))?.times()?;
        row(&mut rows, &name, built.blob().len(), times);
    }
    let page = page(&rows);
    print!("{page}");
    if env::args().any(|argument| argument == "--write") {
        fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/compile-time.md"), page)?;
    }
    Ok(())
}

fn row(rows: &mut String, name: &str, bytes: usize, [check, release]: [f64; 2]) {
    // Writing to a String cannot fail.
    let _ = writeln!(rows, "| {name} | {} | {check:.2} | {release:.2} |", bytes / 1000);
}

fn page(rows: &str) -> String {
    let compiler = Command::new("rustc").arg("--version").output();
    let compiler = compiler.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    let compiler = compiler.unwrap_or_default();
    format!(
        "# Compile time\n\n\
         Written by `cargo bench -p dibs-tests --bench compile_time -- --write`, with {compiler}.\n\n\
         Seconds of processor time, cargo's included, that `cargo check` and `cargo build --release` take for a crate \
         that includes\na tree and validates it at run time, after an edit of its source: the least of {REPEATS}.\n\n\
         | crate | tree, kB | check | release |\n|---|---|---|---|\n{rows}"
    )
}

/// A crate outside the workspace.
struct Crate(PathBuf);

impl Crate {
    fn new(folder: &Path, name: &str, tree: Option<&BuiltTree>) -> Result<Self> {
        let root = folder.join(name);
        fs::create_dir_all(root.join("src"))?;
        let core = Path::new(env!("CARGO_MANIFEST_DIR")).join("../dibs-nostd").canonicalize()?;
        let manifest = format!(
            "[package]\nname = {name:?}\nedition = \"2024\"\n[workspace]\n[dependencies]\ndibs-nostd = {{ path = {core:?} }}\n"
        );
        fs::write(root.join("Cargo.toml"), manifest)?;
        fs::copy(core.join("../Cargo.lock"), root.join("Cargo.lock"))?;
        let source = match tree {
            None => {
                "pub fn mesh_id(bytes: &[u8]) -> Option<u32> {\n    \
                     dibs_nostd::Tree::<u32>::from_bytes(bytes).ok().map(|tree| tree.mesh_id())\n}\n"
            }
            Some(tree) => {
                tree.write_rust(root.join("src/heart.rs"), "heart")?;
                "include!(\"heart.rs\");\npub fn mesh_id() -> Option<u32> {\n    \
                 heart::TREE.validate().ok().map(|tree| tree.mesh_id())\n}\n"
            }
        };
        fs::write(root.join("src/lib.rs"), source)?;
        Ok(Self(root))
    }

    /// Of `cargo check` and of `cargo build --release`, after an edit.
    fn times(&self) -> Result<[f64; 2]> {
        Ok([self.time(&["check"])?, self.time(&["build", "--release"])?])
    }

    fn time(&self, arguments: &[&str]) -> Result<f64> {
        let mut least = f64::INFINITY;
        // The first compiles the dependencies, too.
        for repeat in 0..=REPEATS {
            let file = self.0.join("src/lib.rs");
            fs::write(&file, format!("{}// {repeat}\n", fs::read_to_string(&file)?))?;
            let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
            cargo.args(arguments).arg("--quiet").current_dir(&self.0);
            // The compiler itself, and one folder for all, so that dependencies are compiled once.
            cargo.env("RUSTC_WRAPPER", "").env("CARGO_TARGET_DIR", self.0.join("../target"));
            let before = processor_time()?;
            ensure!(cargo.status()?.success(), "cargo failed in {}", self.0.display());
            if repeat > 0 {
                least = least.min(processor_time()? - before);
            }
        }
        Ok(least)
    }
}

/// Seconds of processor time of the processes that this one has waited for: other load does not count.
fn processor_time() -> Result<f64> {
    let stat = fs::read_to_string("/proc/self/stat").context("this takes Linux")?;
    let (_, fields) = stat.rsplit_once(')').context("a name in parentheses")?;
    let ticks = fields.split_whitespace().skip(13).take(2).map(str::parse::<f64>);
    // Always 100 ticks a second, as far as user space sees.
    Ok(ticks.sum::<Result<f64, _>>()? / 100.0)
}

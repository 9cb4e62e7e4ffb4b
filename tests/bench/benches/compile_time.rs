//! How much longer a crate takes to compile for the tree that it includes, and how long a build script takes to build it.
//!
//! `cargo bench -p dibs-bench --bench compile_time -- --write` writes `docs/evidence/compile-time.md`. The times are those of
//! the machine that runs it; nothing asserts them. `DIBS_FOLDER` keeps the compiled dependencies for the next run,
//! `DIBS_TRIANGLES` takes other sizes. The program `dibs` comes from `cargo build --release`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, BuiltTree, generate};
use xtask::workspace;

const REPEATS: usize = 5;

fn main() -> Result<()> {
    let temporary = tempfile::tempdir()?;
    let folder = env::var_os("DIBS_FOLDER").map(PathBuf::from);
    let folder = folder.as_deref().unwrap_or(temporary.path());
    let (mut rows, mut scripts) = (String::new(), String::new());
    let without = Crate::new(folder, "empty", None)?.times()?;
    row(&mut rows, "without a tree", 0, without, without);
    let sizes = env::var("DIBS_TRIANGLES").unwrap_or_else(|_| "10000 100000".to_owned());
    for triangles in sizes.split_whitespace() {
        let triangles = triangles.parse().context("DIBS_TRIANGLES")?;
        let mesh = generate::heart(triangles)?.mesh;
        let built = Builder::new().build(&mesh)?;
        let name = format!("{triangles} triangles");
        let times = Crate::new(folder, &format!("t{triangles}"), Some(&built))?.times()?;
        row(&mut rows, &name, built.blob().len(), times, without);

        let file = folder.join("heart.ply");
        mesh.write_ply(&file)?;
        let [plain, optimised] = [("plain", ""), ("optimised", LINES)]
            .map(|(name, lines)| script_time(folder, name, lines, &file));
        let (plain, optimised, program) = (plain?, optimised?, program_time(&file)?);
        let ratio = optimised / program;
        // Writing to a String cannot fail.
        let _ = writeln!(
            scripts,
            "| {triangles} | {plain:.1} | {optimised:.1} | {program:.1} | {ratio:.2} |"
        );
    }
    let page = page(&rows, &scripts);
    print!("{page}");
    if env::args().any(|argument| argument == "--write") {
        fs::write(workspace::evidence().join("compile-time.md"), page)?;
    }
    Ok(())
}

fn row(rows: &mut String, name: &str, bytes: usize, times: [f64; 2], without: [f64; 2]) {
    let [check, release] = times;
    let [more_check, more_release] = [check - without[0], release - without[1]];
    // Writing to a String cannot fail.
    let _ = writeln!(
        rows,
        "| {name} | {} | {check:.2} | {more_check:+.2} | {release:.2} | {more_release:+.2} |",
        bytes / 1000
    );
}

fn page(rows: &str, scripts: &str) -> String {
    let compiler = Command::new("rustc").arg("--version").output();
    let compiler = compiler.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    let compiler = compiler.unwrap_or_default();
    format!(
        "# Compile time\n\n\
         Written by `cargo bench -p dibs-bench --bench compile_time -- --write`, with {compiler}. Seconds of processor \
         time of\nthe machine that ran it: other load does not count, another machine has other figures.\n\n\
         ## A crate that includes a tree\n\n\
         After an edit of its source, `cargo check` and `cargo build --release`, cargo's own time included: the least \
         of {REPEATS}. The\ncrate includes a tree and validates it when it runs; *more* is against the crate without.\n\n\
         | crate | tree, kB | check | more | release | more |\n|---|---|---|---|---|---|\n{rows}\n\
         ## A build script\n\n\
         `dibs_build::tree(\"heart.ply\").emit(\"heart\")` in `cargo build`, whose profile optimises nothing: one run, \
         the compilation\nof the script not counted. *With the lines* is with these in the user's `Cargo.toml`:\n\n\
         ```toml\n{LINES}```\n\n\
         | triangles | without | with the lines | `dibs build` | times `dibs build` |\n|---|---|---|---|---|\n{scripts}"
    )
}

/// The README's lines for a user's `Cargo.toml`.
const LINES: &str = "[profile.dev.package.dibs-build]\nopt-level = 3\n";

/// Processor time that a build script takes for the tree of a mesh, in an unoptimised profile with these lines.
fn script_time(folder: &Path, name: &str, lines: &str, mesh: &Path) -> Result<f64> {
    let root = folder.join(name);
    fs::create_dir_all(root.join("src"))?;
    let builder = workspace::root().join("dibs-build");
    let manifest = format!(
        "[package]\nname = {name:?}\nedition = \"2024\"\n[workspace]\n[build-dependencies]\n\
         dibs-build = {{ path = {builder:?} }}\n{lines}"
    );
    fs::write(root.join("Cargo.toml"), manifest)?;
    fs::copy(builder.join("../Cargo.lock"), root.join("Cargo.lock"))?;
    fs::write(root.join("src/lib.rs"), "")?;
    fs::copy(mesh, root.join("heart.ply"))?;
    let script = r#"
fn main() {
    dibs_build::tree("heart.ply").emit("heart");
    std::fs::write("stat", std::fs::read("/proc/self/stat").unwrap()).unwrap();
}
"#;
    fs::write(root.join("build.rs"), script)?;
    cargo(&root, &["build", "--quiet"])?;
    // The script's own time: fields 14 and 15.
    processor_time(&fs::read_to_string(root.join("stat"))?, 11)
}

/// Processor time that the program takes for the same.
fn program_time(mesh: &Path) -> Result<f64> {
    let here = env::current_exe()?;
    let program = here.ancestors().nth(2).context("a target folder")?.join("dibs");
    let before = time_of_children()?;
    let tree = mesh.with_extension("dibs");
    let built = Command::new(&program).arg("build").arg(mesh).arg("-o").arg(&tree).output();
    let built = built.with_context(|| format!("{}: not built", program.display()))?;
    ensure!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    Ok(time_of_children()? - before)
}

fn cargo(folder: &Path, arguments: &[&str]) -> Result<()> {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(arguments).current_dir(folder);
    // The compiler itself, and one folder for all, so that dependencies are compiled once.
    cargo.env("RUSTC_WRAPPER", "").env("CARGO_TARGET_DIR", folder.join("../target"));
    ensure!(cargo.status()?.success(), "cargo failed in {}", folder.display());
    Ok(())
}

/// A crate outside the workspace.
struct Crate(PathBuf);

impl Crate {
    fn new(folder: &Path, name: &str, tree: Option<&BuiltTree>) -> Result<Self> {
        let root = folder.join(name);
        fs::create_dir_all(root.join("src"))?;
        let core = workspace::root().join("dibs-nostd");
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
            let before = time_of_children()?;
            cargo(&self.0, &[arguments, &["--quiet"]].concat())?;
            if repeat > 0 {
                least = least.min(time_of_children()? - before);
            }
        }
        Ok(least)
    }
}

/// Seconds of processor time of the processes that this one has waited for: other load does not count.
fn time_of_children() -> Result<f64> {
    processor_time(&fs::read_to_string("/proc/self/stat").context("this takes Linux")?, 13)
}

/// The sum of two neighbouring times of `/proc/PID/stat`, counted from the field after the name.
fn processor_time(stat: &str, first: usize) -> Result<f64> {
    let (_, fields) = stat.rsplit_once(')').context("a name in parentheses")?;
    let ticks = fields.split_whitespace().skip(first).take(2).map(str::parse::<f64>);
    // Always 100 ticks a second, as far as user space sees.
    Ok(ticks.sum::<Result<f64, _>>()? / 100.0)
}

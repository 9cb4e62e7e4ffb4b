//! Builds and runs programs in C and C++.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use std::{env, fs};

use dibs_build::{Builder, generate};
use dibs_nostd::Tree;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, enframe, framed_bytes};
use xtask::process::quiet;
use xtask::{apt, workspace};

/// The host's static library, built in the profile of this test.
pub fn library() -> PathBuf {
    if !cfg!(debug_assertions) && workspace::is_built() {
        return workspace::target().join("release/libdibs_c.a");
    }
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["rustc", "--quiet", "--package", "dibs-c", "--lib", "--profile", profile]);
    cargo.args(["--crate-type", "staticlib"]).current_dir(workspace::root());
    run(&mut cargo);
    let folder = if cfg!(debug_assertions) { "debug" } else { "release" };
    workspace::target().join(folder).join("libdibs_c.a")
}

/// The library with a feature, in a target folder of its own: the next build of all would compile the other anew.
pub fn library_with(feature: &str) -> PathBuf {
    let target = workspace::target().join("c").join(feature);
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["rustc", "--quiet", "--release", "--package", "dibs-c", "--lib"]);
    cargo.args(["--features", feature, "--crate-type", "staticlib", "--target-dir"]).arg(&target);
    run(cargo.current_dir(workspace::root()));
    target.join("release/libdibs_c.a")
}

/// A folder into which the library is installed.
pub fn installed(folder: &Path) -> PathBuf {
    let (build, prefix) = (folder.join("library"), folder.join("prefix"));
    let mut configure = tool("cmake", "cmake");
    configure.arg("-S").arg(env!("CARGO_MANIFEST_DIR")).arg("-B").arg(&build);
    configure.arg("-DCMAKE_INSTALL_LIBDIR=lib");
    run(configure.arg(format!("-DDIBS_LIBRARY={}", library().display())));
    run(Command::new("cmake").arg("--install").arg(&build).arg("--prefix").arg(&prefix));
    prefix
}

/// The header's folder.
pub fn include() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include")
}

/// Runs a program that must succeed. Returns its output.
pub fn run(command: &mut Command) -> String {
    let output = command.output().expect("a program that starts");
    let [out, err] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
    assert!(output.status.success(), "{command:?}: {}\n{out}\n{err}", output.status);
    out
}

/// Compiles a program of `tests/programs` with the library, under sanitizers.
pub fn compile(name: &str, folder: &Path) -> PathBuf {
    let program = folder.join(name);
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs");
    gcc.arg(sources.join(name).with_extension("c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    program
}

/// A command by name, installed where it is missing.
pub fn tool(name: &str, package: &str) -> Command {
    // Two installations would refuse each other.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let version = quiet(Command::new(name).arg("--version"), Duration::from_secs(20));
    if version.is_err() {
        apt::install(&[package]).unwrap_or_else(|error| panic!("no {name}: {error:#}"));
    }
    Command::new(name)
}

/// Writes a tree, and two frames of its rest shape in the bytes of a serial line. Returns the paths of both files.
pub fn tree_and_stream(folder: &Path) -> [PathBuf; 2] {
    let mesh = generate::heart(1_000).expect("a size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let mesh_id = Tree::<u16>::from_bytes(built.blob()).expect("a tree").mesh_id();
    let rows = built.to_rows(&mesh.positions);
    let mut line = Vec::new();
    for epoch in 1..=2 {
        let id = FrameId { mesh_id, session: 1, epoch };
        let frame = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]);
        let (mut frame, mut packet) = (frame.expect("a frame"), [0; 256]);
        while let Some(packet) = frame.next_packet(&mut packet) {
            line.extend_from_slice(enframe(packet, &mut [0; framed_bytes(256)]).expect("room"));
        }
    }
    let [tree, stream] = ["tree", "stream"].map(|name| folder.join(name));
    fs::write(&tree, built.blob()).expect("writable");
    fs::write(&stream, line).expect("writable");
    [tree, stream]
}

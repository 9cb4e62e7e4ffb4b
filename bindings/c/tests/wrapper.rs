//! `include/dibs.hpp`, installed, compiles as C++17 without exceptions, and its queries answer.

// Requirement: P-06

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dibs_build::{Builder, Volume, generate};

use crate::programs::{installed, run, tool, tree_and_stream};

#[test]
fn the_wrapper_answers_without_exceptions() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("wrapper");
    let mut compiler = tool("g++", "g++");
    compiler.args(["-std=c++17", "-fno-exceptions", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    compiler.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"]);
    compiler.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/wrapper.cpp"));
    let mut flags = tool("pkg-config", "pkg-config");
    flags.env("PKG_CONFIG_PATH", installed(folder.path()).join("lib/pkgconfig"));
    let flags =
        run(flags.args(["--cflags", "--libs", concat!("dibs = ", env!("CARGO_PKG_VERSION"))]));
    run(compiler.args(flags.split_whitespace()).arg("-o").arg(&program));

    let files = tree_and_stream(folder.path()).into_iter().chain(nodes(folder.path()));
    let said = run(Command::new(program).args(files));
    assert!(said.contains(" mm, ") && said.contains(" rows"), "{said}");
}

/// Writes a tree of the same heart that nodes carry, and the nodes' positions at rest. Returns the paths of both files.
fn nodes(folder: &Path) -> [PathBuf; 2] {
    let mesh = generate::heart(1_000).expect("a size").mesh;
    let lattice = Volume::lattice(&mesh, [3, 3, 4]).expect("a lattice");
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).expect("a tree");
    let positions = lattice.nodes().iter().flat_map(|at| at.as_vec3().to_array());
    let [tree, at_rest] = ["tree-of-nodes", "nodes"].map(|name| folder.join(name));
    fs::write(&tree, built.blob()).expect("writable");
    fs::write(&at_rest, positions.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
        .expect("writable");
    [tree, at_rest]
}

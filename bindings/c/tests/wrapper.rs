//! `include/dibs.hpp`, installed, compiles as C++17 without exceptions, and its queries answer.

// Requirement: P-06

use std::path::Path;
use std::process::Command;

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

    let said = run(Command::new(program).args(tree_and_stream(folder.path())));
    assert!(said.contains(" mm, ") && said.contains(" rows"), "{said}");
}

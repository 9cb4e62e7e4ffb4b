//! `include/dibs.hpp` compiles as C++20 without exceptions, and its queries answer.

use std::path::Path;
use std::process::Command;

use crate::programs::{include, library, run, tool, tree_and_stream};

#[test]
fn the_wrapper_answers_without_exceptions() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("wrapper");
    let mut compiler = tool("g++", "g++");
    compiler.args(["-std=c++20", "-fno-exceptions", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]);
    compiler.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"]);
    compiler.arg("-I").arg(include());
    compiler.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/wrapper.cpp"));
    run(compiler.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));

    let said = run(Command::new(program).args(tree_and_stream(folder.path())));
    assert!(said.contains(" mm, ") && said.contains(" rows"), "{said}");
}

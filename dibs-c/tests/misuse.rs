//! Misuse in C returns a code, and touches no memory outside the object.

mod programs;

use std::path::Path;
use std::process::Command;

use programs::{include, library, run, tool, tree_and_stream};

#[test]
fn misuse_is_a_code_under_the_sanitizers() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("misuse");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror", "-pthread"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/misuse.c"));
    run(gcc.arg(library()).args(["-ldl", "-lm", "-o"]).arg(&program));

    let said = run(Command::new(program).args(tree_and_stream(folder.path())));
    assert!(said.contains(" checks, 0 failures"), "{said}");
}

//! The README's programs compile.

// Requirements: P-06, P-11

use std::fs;
use std::path::Path;

use crate::programs::{include, run, tool};

/// One after the other, without a warning.
#[test]
fn the_readme_compiles() {
    let folder = tempfile::tempdir().expect("a folder");
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(readme).expect("the README");
    let blocks = readme.split("```c\n").skip(1).filter_map(|block| block.split("```").next());
    let blocks: Vec<_> = blocks.collect();
    assert!(blocks.len() >= 3, "{} programs", blocks.len());
    let source = folder.path().join("readme.c");
    fs::write(&source, blocks.concat()).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"]).arg(include());
    run(gcc.arg(source));
}

//! Misuse in C returns a code, and touches no memory outside the object.

// Requirement: P-06

use std::path::Path;
use std::process::Command;

use crate::programs::{include, library, run, tool, tree_and_stream};

#[test]
fn misuse_is_a_code_under_the_sanitizers() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = tree_and_stream(folder.path());
    for name in ["misuse", "misuse_scene"] {
        let program = folder.path().join(name);
        let mut gcc = tool("gcc", "gcc");
        gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror", "-pthread"]);
        gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"])
            .arg(include());
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs");
        gcc.arg(sources.join(name).with_extension("c"));
        run(gcc.arg(library()).args(["-ldl", "-lm", "-o"]).arg(&program));

        let said = run(Command::new(program).args(&files));
        assert!(said.contains(" checks, 0 failures"), "{name}: {said}");
        if name == "misuse" {
            causes_read_as_in_rust(&said);
        }
    }
}

/// A code and the cause without a parameter that it stands for have one sentence.
fn causes_read_as_in_rust(said: &str) {
    use dibs_nostd::Unavailable::{
        CorruptTree, CutShort, NoDirection, NoPose, NoSide, NoSurface, NotFinite, Unacknowledged,
    };
    let causes =
        [NoSurface, Unacknowledged, CorruptTree, NoDirection, CutShort, NotFinite, NoSide, NoPose];
    for cause in causes {
        let row = format!("{} {cause}", crate::guard::cause(cause));
        assert!(said.lines().any(|line| line == row), "{row}");
    }
}

//! The layers below bus and guard answer a script with the same bits as the Rust library.

// Requirement: P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::programs::{include, library, run, tool};
use crate::script::Script;

#[test]
fn c_and_rust_answer_a_script_with_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("layers");
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/layers");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]).arg(include());
    gcc.args(
        ["bus", "main", "print", "script", "track"].map(|name| sources.join(format!("{name}.c"))),
    );
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));

    let script = Script::new();
    let mut program = Command::new(program);
    for (name, bytes) in [
        ("tree", &script.tree),
        ("frames", &script.frames),
        ("script", &script.lines.clone().into()),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("writable");
        program.arg(path);
    }
    let answers = run(&mut program);
    let expected = script.answers();
    assert!(expected.len() >= 1_000, "{} answers", expected.len());
    // Ticks before the first frame, nominal, degraded and with a frame too old; a damaged packet and one without a
    // frame; a tracker's later answers and its first; contacts; chains with tools passed over and not; both surfaces of
    // a scene.
    for start in [
        "tick 300 2",
        "tick 0 0",
        "tick 0 1",
        "tick 301 2",
        "packet 400",
        "packet 406",
        "track 0",
        "track 1",
        "touch 0",
        "chain 1 1 0",
        "chain 1 2 ",
        "scene 0 0 0",
        "scene 0 1 1",
    ] {
        assert!(expected.iter().any(|line| line.starts_with(start)), "nothing is {start}");
    }
    // A frame that is stretched too far.
    assert!(expected.iter().any(|line| line.starts_with("packet") && line.contains(" 311 ")));
    for (number, (c, rust)) in answers.lines().zip(&expected).enumerate() {
        assert_eq!(c, rust, "answer {number}");
    }
    assert_eq!(answers.lines().count(), expected.len());
}

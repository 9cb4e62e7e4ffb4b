//! No output of the program replaces an input or another output.

// Requirement: P-08

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::program::{fails, succeeds};

/// Every file of a folder, by its name.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    entries
        .filter(|path| path.is_file())
        .map(|path| (name(&path), fs::read(path).unwrap()))
        .collect()
}

/// A folder with a file of each kind that a command reads.
fn inputs() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(at, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(at, "stretch heart.ply --motion heart.pc2 --limits heart.limits");
    succeeds(at, "build heart.ply -o tree.dibs --limits heart.limits");
    // A mesh is told by its content, not by its name.
    fs::copy(at.join("heart.ply"), at.join("mesh.dibs")).unwrap();
    fs::write(at.join("labels.dibs"), "1\n".repeat(320)).unwrap();
    fs::copy(at.join("heart.limits"), at.join("limits.dibs")).unwrap();
    fs::copy(at.join("heart.pc2"), at.join("motion.dibs")).unwrap();
    fs::write(at.join("poses.csv"), "0,0,150,5\n").unwrap();
    fs::write(at.join("page.html"), "<!--data-->").unwrap();
    for frame in ["frame_1.ply", "frame_2.ply"] {
        fs::copy(at.join("heart.ply"), at.join(frame)).unwrap();
    }
    let buffer =
        r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"a%20buffer.bin","byteLength":1}]}"#;
    fs::write(at.join("scene.gltf"), buffer).unwrap();
    fs::write(at.join("a buffer.bin"), "x").unwrap();
    folder
}

#[test]
fn no_output_replaces_an_input() {
    let folder = inputs();
    let at = folder.path();
    let before = contents(at);
    for (line, input) in [
        ("build mesh.dibs -o mesh.dibs", "mesh.dibs"),
        ("build mesh.dibs -o ./mesh.dibs", "mesh.dibs"),
        // The blob beside the source.
        ("build mesh.dibs -o mesh.rs", "mesh.dibs"),
        ("build heart.ply --labels labels.dibs -o labels.dibs", "labels.dibs"),
        ("build heart.ply --limits limits.dibs -o limits.dibs", "limits.dibs"),
        ("build heart.ply --motion motion.dibs -o motion.dibs", "motion.dibs"),
        ("stretch heart.ply --motion heart.pc2 --limits heart.ply", "heart.ply"),
        ("stretch heart.ply --motion heart.pc2 --picture heart.pc2", "heart.pc2"),
        ("stretch heart.ply --motion frame_%d.ply --limits frame_2.ply", "frame_2.ply"),
        ("stretch scene.gltf --motion heart.pc2 --limits scene.gltf", "scene.gltf"),
        ("query tree.dibs --poses poses.csv -o poses.csv", "poses.csv"),
        ("query tree.dibs --poses poses.csv -o tree.dibs", "tree.dibs"),
        ("query tree.dibs --poses poses.csv --vertices heart.ply -o heart.ply", "heart.ply"),
        ("view tree.dibs --page page.html -o tree.dibs", "tree.dibs"),
        ("view tree.dibs --motion heart.pc2 --page page.html -o heart.pc2", "heart.pc2"),
        ("view tree.dibs --page page.html -o page.html", "page.html"),
        (
            "view tree.dibs --motion heart.pc2 --path poses.csv --page page.html -o poses.csv",
            "poses.csv",
        ),
    ] {
        let error = fails(at, line);
        assert!(
            error.contains(input) && error.contains("same file as the input"),
            "{line}: {error}"
        );
        assert_eq!(contents(at), before, "{line}");
    }
    // A buffer of a glTF document is a part of it.
    let mut program = Command::new(env!("CARGO_BIN_EXE_dibs"));
    program.current_dir(at).args([
        "stretch",
        "scene.gltf",
        "heart.pc2",
        "--limits",
        "a buffer.bin",
    ]);
    let output = program.output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && error.contains("same file as the input"), "{error}");
    assert_eq!(contents(at), before);
}

#[test]
fn no_output_replaces_another() {
    let folder = inputs();
    let at = folder.path();
    let before = contents(at);
    for line in [
        "generate heart --triangles 320 -o new.ply --motion new.ply",
        "generate heart --triangles 320 -o new.ply --motion ./new.ply",
        "stretch heart.ply --motion heart.pc2 --limits new --picture new",
        "stretch heart.ply --motion heart.pc2 --limits poses.csv --picture ./poses.csv",
    ] {
        let error = fails(at, line);
        assert!(error.contains("same file as the output"), "{line}: {error}");
        assert_eq!(contents(at), before, "{line}");
    }
    // An output of before is replaced.
    succeeds(at, "build heart.ply -o tree.dibs --stretch 2");
    assert_ne!(contents(at)["tree.dibs"], before["tree.dibs"]);
}

#[cfg(unix)]
#[test]
fn links_and_redirections_are_seen_through() {
    let folder = inputs();
    let at = folder.path();
    fs::hard_link(at.join("mesh.dibs"), at.join("hard.dibs")).unwrap();
    std::os::unix::fs::symlink("mesh.dibs", at.join("soft.dibs")).unwrap();
    std::os::unix::fs::symlink(at, at.join("folder")).unwrap();
    let before = contents(at);
    for line in [
        "build mesh.dibs -o hard.dibs",
        "build mesh.dibs -o soft.dibs",
        "build soft.dibs -o mesh.dibs",
        "build hard.dibs -o soft.dibs",
        "build mesh.dibs -o folder/mesh.dibs",
        "build folder/mesh.dibs -o hard.rs",
        "generate heart --triangles 320 -o new.ply --motion folder/new.ply",
    ] {
        let error = fails(at, line);
        assert!(error.contains("same file as the"), "{line}: {error}");
        assert_eq!(contents(at), before, "{line}");
    }
    let poses = || File::options().read(true).append(true).open(at.join("poses.csv")).unwrap();
    let run = |line: &str, input: Stdio, output: Stdio| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_dibs"));
        program.current_dir(at).args(line.split_whitespace()).stdin(input).stdout(output);
        let output = program.stderr(Stdio::piped()).output().unwrap();
        (output.status.success(), String::from_utf8(output.stderr).unwrap())
    };
    for (line, input, output) in [
        ("query tree.dibs --poses - -o poses.csv", poses().into(), Stdio::null()),
        ("query tree.dibs --poses poses.csv", Stdio::null(), poses().into()),
        ("track tree.dibs --motion heart.pc2 --path poses.csv", Stdio::null(), poses().into()),
    ] {
        let (is_done, error) = run(line, input, output);
        assert!(!is_done && error.contains("same file as the input"), "{line}: {error}");
        assert_eq!(contents(at), before, "{line}");
    }
    let (is_done, error) = run("query tree.dibs --poses -", poses().into(), Stdio::null());
    assert!(is_done, "{error}");
}

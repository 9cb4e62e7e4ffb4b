//! The page without data, which a checkout's program makes once: here by stand-ins for Node.js and Cargo.

// Requirement: P-09

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::program::succeeds;

/// A copy of the program in a folder of its own, and stand-ins for the programs that it starts.
struct Copy {
    folder: tempfile::TempDir,
}

impl Copy {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let copy = Self { folder };
        fs::create_dir_all(copy.path("target/release")).unwrap();
        fs::create_dir(copy.path("bin")).unwrap();
        fs::copy(env!("CARGO_BIN_EXE_dibs"), copy.path("target/release/dibs")).unwrap();
        succeeds(copy.folder.path(), "generate heart --triangles 320 -o heart.ply");
        succeeds(copy.folder.path(), "build heart.ply -o heart.dibs");
        copy
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn checkout(&self) {
        for file in ["viewer/build.mjs", "xtask/Cargo.toml", "dibs-nostd/Cargo.toml"] {
            let path = self.path(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
    }

    /// A program of this name, which runs these lines of shell.
    fn program(&self, name: &str, lines: &str) {
        let path = self.path("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{lines}\n")).unwrap();
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn view(&self) -> Output {
        let mut view = Command::new(self.path("target/release/dibs"));
        view.args(["view", "heart.dibs", "-o", "heart.html", "--json"]);
        view.current_dir(self.folder.path()).env("PATH", self.path("bin")).output().unwrap()
    }

    /// What it says where it fails, which leaves nothing.
    fn fails(&self) -> String {
        let output = self.view();
        assert_eq!(output.status.code(), Some(1));
        assert!(output.stdout.is_empty() && !self.path("heart.html").exists());
        assert!(!self.page().exists());
        String::from_utf8(output.stderr).unwrap()
    }

    fn page(&self) -> PathBuf {
        self.path("target/release/dibs-viewer.html")
    }
}

fn is_one_sentence(error: &str) -> bool {
    error.lines().count() == 1 && error.contains("dibs-viewer.html is missing")
}

#[test]
fn a_missing_page_is_made_once_or_its_remedy_is_named() {
    let copy = Copy::new();
    let error = copy.fails();
    assert!(is_one_sentence(&error) && error.contains("--page"), "{error}");
    copy.checkout();
    let error = copy.fails();
    assert!(is_one_sentence(&error) && error.contains("Node.js"), "{error}");
    for program in ["node", "npm"] {
        copy.program(program, "exit 0");
    }
    // A build that fails, and one that claims to have worked.
    copy.program("cargo", "[ \"$1\" = --version ] || { echo no network >&2; exit 1; }");
    let error = copy.fails();
    assert!(error.contains("making ") && error.contains("no network"), "{error}");
    copy.program("cargo", "exit 0");
    assert!(copy.fails().contains("did not write"));

    let writes = "echo compiling\n[ \"$*\" = 'xtask viewer' ] && echo '<p><!--data-->' > target/release/dibs-viewer.html; exit 0";
    copy.program("cargo", writes);
    let output = copy.view();
    let (said, told) =
        [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap()).into();
    assert!(output.status.success(), "{told}");
    assert!(told.contains("making ") && told.contains("compiling"), "{told}");
    assert!(said.starts_with('{') && said.lines().count() == 1, "the answer alone: {said}");
    assert!(fs::read_to_string(copy.path("heart.html")).unwrap().starts_with("<p><script"));
    // It is there: nothing is started again.
    copy.program("cargo", "exit 1");
    let output = copy.view();
    assert!(output.status.success() && output.stderr.is_empty());
    assert!(Path::new(&copy.page()).is_file());
}

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
    /// The program's folder.
    place: &'static str,
}

impl Copy {
    fn new(place: &'static str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let copy = Self { folder, place };
        fs::create_dir_all(copy.path(place)).unwrap();
        fs::create_dir(copy.path("bin")).unwrap();
        fs::copy(env!("CARGO_BIN_EXE_dibs"), copy.path(place).join("dibs")).unwrap();
        succeeds(copy.folder.path(), "generate heart --triangles 320 -o heart.ply");
        succeeds(copy.folder.path(), "build heart.ply -o heart.dibs");
        copy
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn checkout(&self) {
        for file in ["Cargo.toml", "viewer/build.mjs", "xtask/Cargo.toml", "dibs-nostd/Cargo.toml"]
        {
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
        let mut view = Command::new(self.path(self.place).join("dibs"));
        view.args(["view", "heart.dibs", "-o", "heart.html", "--json"]);
        // The target folder is this one's, also where the checkout is the real one.
        view.env("PATH", self.path("bin")).env("CARGO_TARGET_DIR", self.path("target"));
        view.current_dir(self.folder.path()).output().unwrap()
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
        self.path(self.place).join("dibs-viewer.html")
    }
}

fn is_one_sentence(error: &str) -> bool {
    error.lines().count() == 1 && error.contains("dibs-viewer.html is missing")
}

#[test]
fn a_missing_page_is_made_once_or_its_remedy_is_named() {
    let copy = Copy::new("target/release");
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

/// `cargo xtask viewer` writes the page into the target folder, where an installed program is not.
#[test]
fn an_installed_program_has_the_page_of_the_checkout_in_which_it_was_compiled() {
    let copy = Copy::new("installed");
    fs::create_dir_all(copy.path("target/viewer")).unwrap();
    for program in ["node", "npm"] {
        copy.program(program, "exit 0");
    }
    let writes = "[ \"$*\" = 'xtask viewer' ] && echo '<p>made<!--data-->' > \"$CARGO_TARGET_DIR/viewer/dibs-viewer.html\"; exit 0";
    copy.program("cargo", writes);
    let output = copy.view();
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    assert!(told.contains(&format!("in {} ", checkout.display())), "it says where: {told}");
    assert!(fs::read_to_string(copy.path("heart.html")).unwrap().starts_with("<p>made<script"));
    // Beside the program is the page, and nothing else.
    assert_eq!(fs::read_to_string(copy.page()).unwrap(), "<p>made<!--data-->\n");
    let files = fs::read_dir(copy.path("installed")).unwrap();
    let mut files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
    files.sort_unstable();
    assert_eq!(files, ["dibs", "dibs-viewer.html"]);
}

//! Counts the lines of sources.

// Requirement: E-04

use std::ops::AddAssign;
use std::path::{Path, PathBuf};
use std::{fs, iter};

use crate::page::REPOSITORY;

/// Lines of Rust.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    pub all: u32,
    /// Without comments and blank lines.
    pub code: u32,
}

impl Lines {
    pub fn of(text: &str) -> Self {
        let (mut lines, mut is_comment) = (Self::default(), false);
        for line in text.lines().map(str::trim) {
            lines.all += 1;
            let begins = line.starts_with("/*");
            let is_code = !line.is_empty() && !line.starts_with("//") && !begins && !is_comment;
            lines.code += u32::from(is_code);
            is_comment = (is_comment || begins) && !line.ends_with("*/");
        }
        lines
    }
}

/// Lines of the files that are counted, below folders or of files of the repository.
pub fn sum(places: &[PathBuf], is_counted: fn(&Path) -> bool) -> Lines {
    let mut sum = Lines::default();
    for file in places.iter().flat_map(|place| files(place)).filter(|file| is_counted(inside(file)))
    {
        sum += Lines::of(&read(&file));
    }
    sum
}

/// A place in the repository.
pub fn place(path: &str) -> PathBuf {
    Path::new(REPOSITORY).join(path)
}

/// A file's path in the repository.
pub fn inside(file: &Path) -> &Path {
    file.strip_prefix(REPOSITORY).expect("in the repository")
}

impl Lines {
    pub fn less(self, other: Self) -> Self {
        Self { all: self.all - other.all, code: self.code - other.code }
    }
}

impl AddAssign for Lines {
    fn add_assign(&mut self, other: Self) {
        self.all += other.all;
        self.code += other.code;
    }
}

/// A Rust file outside files and folders named tests, by its path in the repository.
pub fn is_product(file: &Path) -> bool {
    let is_test = |part: &str| ["test", "tests"].contains(&part) || part.ends_with("tests.rs");
    is_source(file) && !file.iter().any(|part| part.to_str().is_some_and(is_test))
}

pub fn is_source(file: &Path) -> bool {
    file.extension().is_some_and(|kind| kind == "rs")
}

/// The files below a folder, or a file, in their order. What is hidden, or built, is left out.
pub fn files(place: &Path) -> Box<dyn Iterator<Item = PathBuf>> {
    if !place.is_dir() {
        return Box::new(iter::once(place.to_owned()));
    }
    let entries = fs::read_dir(place).expect("a folder").map(|entry| entry.expect("an entry"));
    let is_ours = |name: &str| {
        !name.starts_with('.') && !["target", "node_modules", "__pycache__"].contains(&name)
    };
    let ours = entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours));
    // A link's target is counted where it is.
    let real = ours.filter(|entry| !entry.file_type().expect("a type").is_symlink());
    let mut paths: Vec<PathBuf> = real.map(|entry| entry.path()).collect();
    paths.sort();
    Box::new(paths.into_iter().flat_map(|path| files(&path)))
}

pub fn read(file: &Path) -> String {
    fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

#[test]
fn comments_and_blank_lines_are_no_code() {
    let text = "//! One.\n\n/* Two,\nthree. */\nfn four() {\n    // Five.\n}\n";
    assert_eq!(Lines::of(text), Lines { all: 7, code: 2 });
    assert!(is_product(Path::new("a/src/b.rs")) && !is_product(Path::new("a/src/b.md")));
    for test in ["a/tests/b.rs", "a/src/tests.rs", "a/src/bound_tests.rs"] {
        assert!(!is_product(Path::new(test)), "{test}");
    }
}

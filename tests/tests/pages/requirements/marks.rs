//! The requirement ids that sources state.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::page::REPOSITORY;

/// A source file that states requirements, or must.
pub struct Mark {
    /// From the repository's root.
    pub file: String,
    pub ids: BTreeSet<String>,
    /// Whether it tests requirements; other files implement them.
    pub is_test: bool,
    pub checks: Vec<String>,
}

impl Mark {
    /// A link from `docs/evidence`. Checks have names of their own.
    pub fn link(&self) -> String {
        let name = match &self.checks[..] {
            [] => self.short().to_owned(),
            checks => {
                checks.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
            }
        };
        format!("[{name}](../../{})", self.file)
    }

    /// Whether its requirements are those of another file that states none: it is the head of that file's folder.
    pub fn speaks_for(&self, file: &str) -> bool {
        let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
        let is_head = [format!("{folder}/mod.rs"), format!("{folder}.rs")].contains(&self.file);
        is_head && !self.ids.is_empty()
    }

    /// Enough of its path to be unique.
    fn short(&self) -> &str {
        let parts =
            if self.file.ends_with("/mod.rs") || self.file.ends_with("/tests.rs") { 3 } else { 2 };
        let at = self.file.rmatch_indices('/').nth(parts - 1).map_or(0, |(at, _)| at + 1);
        self.file.get(at..).unwrap_or(&self.file)
    }
}

/// Folders with sources, of this repository.
const FOLDERS: [&str; 9] = [
    "dibs-nostd/src",
    "dibs-build",
    "dibs-stream",
    "dibs-cli",
    "bindings",
    "examples",
    "firmware-example",
    "tests",
    "xtask/src",
];
/// All of its files serve requirements.
const CORE: &str = "dibs-nostd/src/";
/// The viewer's folders, except those that its tools fill.
const VIEWER: [&str; 2] = ["viewer/src", "viewer/test"];

/// Every file that states requirements, and every file of tests or of the core that states none.
pub fn marks() -> Vec<Mark> {
    let proofs = proofs();
    let mut marks = Vec::new();
    for folder in FOLDERS.iter().chain(&VIEWER) {
        visit(&Path::new(REPOSITORY).join(folder), folder, &mut |file, text| {
            let checks = proofs.get(&file);
            let ids = ids(text);
            let is_test =
                checks.is_some() || file.ends_with("tests.rs") || file.contains("/tests/");
            let must = checks.is_some() || file.ends_with("tests.rs") || file.starts_with(CORE);
            if must || !ids.is_empty() {
                marks.push(Mark {
                    file,
                    ids,
                    is_test,
                    checks: checks.cloned().unwrap_or_default(),
                });
            }
        });
    }
    assert!(
        proofs.keys().all(|file| marks.iter().any(|mark| mark.file == *file)),
        "a row of no file"
    );
    marks.sort_by(|a, b| a.file.cmp(&b.file));
    marks
}

/// The ids after the mark of a source.
fn ids(text: &str) -> BTreeSet<String> {
    let marks = ["// Requirement: ", "// Requirements: "];
    let line = text.lines().find_map(|line| marks.iter().find_map(|mark| line.strip_prefix(mark)));
    line.into_iter().flat_map(|line| line.split(", ")).map(str::to_owned).collect()
}

/// The sources that `docs/proofs.md` names, with the checks in each.
fn proofs() -> BTreeMap<String, Vec<String>> {
    let page = fs::read_to_string(Path::new(REPOSITORY).join("docs/proofs.md")).expect("the page");
    let mut files: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut is_check = false;
    for line in page.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            is_check = title == "Checks";
        }
        let links = line.split("](../").skip(1).filter_map(|rest| rest.split(')').next());
        let is_source = |link: &&str| link.ends_with(".rs") || link.ends_with(".mjs");
        for (at, link) in links.filter(is_source).enumerate() {
            let checks = files.entry(link.to_owned()).or_default();
            if is_check && at == 0 {
                checks.extend(line.split('|').nth(1).map(|name| name.trim().to_owned()));
            }
        }
    }
    files
}

/// Visits the sources below a folder.
fn visit(folder: &Path, name: &str, with: &mut impl FnMut(String, &str)) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let entry = entry.expect("an entry");
        let inner = entry.file_name().into_string().expect("a name");
        let name = format!("{name}/{inner}");
        if entry.path().is_dir() {
            if !["target", "node_modules"].contains(&inner.as_str()) {
                visit(&entry.path(), &name, with);
            }
        } else if inner.ends_with(".rs") || inner.ends_with(".mjs") {
            with(name, &fs::read_to_string(entry.path()).expect("a source"));
        }
    }
}

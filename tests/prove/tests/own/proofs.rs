//! The page of proofs is complete.

// Requirement: E-03

use std::collections::BTreeSet;
use std::fs;

use dibs_prove::checks::CHECKS;
use xtask::workspace;

/// A row without a check of that name, a check or a test without a row, or a link to nowhere.
#[test]
fn the_page_of_proofs_names_every_check_and_files_that_exist() {
    let docs = workspace::root().join("docs");
    let page = fs::read_to_string(docs.join("proofs.md")).expect("a page");
    let table = page.split("## Checks").nth(1).and_then(|rest| rest.split("## Tests").next());
    let rows = table.expect("a table").lines().filter_map(|line| line.split('|').nth(1));
    let named: BTreeSet<&str> = rows.map(str::trim).skip(2).collect();
    let checks: BTreeSet<&str> = CHECKS.iter().map(|check| check.name).collect();
    assert_eq!(named, checks);
    let links = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let links: BTreeSet<&str> = links.collect();
    for link in &links {
        assert!(docs.join(link).exists(), "{link} is not there");
    }
    let folders = [
        "tests/tests",
        "tests/bench/tests",
        "tests/prove/tests",
        "dibs-build/tests",
        "dibs-stream/tests",
        "dibs-cli/tests",
        "bindings/c/tests",
        "firmware-example/tests",
    ];
    for folder in folders {
        for file in files(folder) {
            let link = format!("../{file}");
            assert!(links.contains(&link[..]), "{link}: no row");
        }
    }
}

/// The Rust files below a folder that have tests: a `main.rs` lists others, and a folder with a `mod.rs` helps them.
fn files(folder: &str) -> Vec<String> {
    let entries = fs::read_dir(workspace::root().join(folder)).expect("a folder");
    let mut found = Vec::new();
    for entry in entries.map(|entry| entry.expect("an entry")) {
        let name = entry.file_name().into_string().expect("a name");
        let path = format!("{folder}/{name}");
        if entry.path().is_dir() {
            let helps = entry.path().join("mod.rs").exists();
            found.extend(if helps { Vec::new() } else { files(&path) });
        } else if name.ends_with(".rs") && name != "main.rs" {
            found.push(path);
        }
    }
    found
}

#[test]
fn no_two_promises_are_of_one_figure() {
    let ids = || CHECKS.iter().flat_map(|check| check.promises).map(|promise| promise.id);
    assert_eq!(ids().collect::<BTreeSet<_>>().len(), ids().count());
}

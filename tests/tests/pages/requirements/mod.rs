//! Requirements have ids, and a trace in both directions: `docs/evidence/requirements.md`, which `DIBS_WRITE=1` writes
//! again.
//!
//! Sources state what they implement and what they test, in a line after the file's documentation, as in this file.
//! These fail: an id without implementation or test, a file of tests without id, a file of the core without id in a
//! folder whose head has none, an unknown id, a figure not recorded.

// Requirement: E-03

mod list;
mod marks;

use std::collections::BTreeSet;
use std::fmt::Write;

use serde_json::Value;

use self::list::{AREAS, REQUIREMENTS, Requirement};
use self::marks::{Mark, marks};
use crate::page;

const HEAD: &str = "\
# Requirements

Written by `DIBS_WRITE=1 cargo test -p dibs-tests --test pages`: do not edit. The list is
[list.rs](../../tests/tests/pages/requirements/list.rs); sources name the ids that they implement and test, and that test fails
on an id without implementation or test, on a file of tests without an id, and on a file of the core without one: its own, or
that of the head of its folder (`mod.rs`, or the file with the folder's name). A bound is that of the figure in
[guarantees.md](guarantees.md), in whose column *check* the names in quotes are found.

**Nothing here is certified, and no certification is claimed.**
";

#[test]
fn the_page_traces_every_requirement() {
    let (marks, records) = (marks(), page::records("guarantees.json"));
    let faults = faults(REQUIREMENTS, &marks, &records);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    page::keep("requirements.md", &text(REQUIREMENTS, &marks, &records));
}

/// Violations of the trace.
fn faults(list: &[Requirement], marks: &[Mark], records: &[Value]) -> Vec<String> {
    let mut faults = Vec::new();
    let ids: BTreeSet<&str> = list.iter().map(|requirement| requirement.id).collect();
    if ids.len() < list.len() {
        faults.push("an id is listed twice".to_owned());
    }
    for Requirement { id, figures, .. } in list {
        let has = |is_test| marks.iter().any(|m| m.is_test == is_test && m.ids.contains(*id));
        if !has(false) {
            faults.push(format!("{id}: no source implements it"));
        }
        if !has(true) {
            faults.push(format!("{id}: no test or check shows it"));
        }
        if !AREAS.iter().any(|(letter, _)| id.starts_with(*letter)) {
            faults.push(format!("{id}: of no area"));
        }
        for figure in *figures {
            if !records.iter().any(|record| record["id"] == *figure) {
                faults.push(format!("{id}: {figure} is not recorded"));
            }
        }
    }
    for Mark { file, ids: named, is_test, .. } in marks {
        if named.is_empty() {
            if *is_test {
                faults.push(format!("{file}: tests of no requirement"));
            } else if !marks.iter().any(|head| head.speaks_for(file)) {
                faults.push(format!(
                    "{file}: neither it nor the head of its folder names a requirement"
                ));
            }
        }
        for id in named.iter().filter(|id| !ids.contains(id.as_str())) {
            faults.push(format!("{file}: {id} is not listed"));
        }
    }
    faults
}

fn text(list: &[Requirement], marks: &[Mark], records: &[Value]) -> String {
    let mut text = HEAD.to_owned();
    for (letter, title) in AREAS {
        let _ = write!(
            text,
            "\n## {title}\n\n| id | requirement | bounds | implemented in | shown by |\n|---|---|---|---|---|\n"
        );
        for Requirement { id, says, figures } in list.iter().filter(|r| r.id.starts_with(letter)) {
            let bound = |figure: &&str| {
                let record = records.iter().find(|record| record["id"] == **figure)?;
                Some(format!("`{figure}`: {}", record["bound"].as_str()?))
            };
            let bounds: Vec<_> = figures.iter().filter_map(bound).collect();
            let cell = |is_test| {
                let named = marks.iter().filter(|m| m.is_test == is_test && m.ids.contains(*id));
                named.map(Mark::link).collect::<Vec<_>>().join(", ")
            };
            let (bounds, sources, tests) = (bounds.join("; "), cell(false), cell(true));
            let _ = writeln!(text, "| {id} | {says} | {bounds} | {sources} | {tests} |");
        }
    }
    text
}

#[test]
fn orphans_are_found() {
    let mark = |file: &str, ids: &[&str], is_test| Mark {
        file: file.to_owned(),
        ids: ids.iter().map(|&id| id.to_owned()).collect(),
        is_test,
        checks: Vec::new(),
    };
    let list = [
        Requirement { id: "A-01", says: "", figures: &[] },
        Requirement { id: "A-02", says: "", figures: &["none"] },
    ];
    let whole = [mark("a.rs", &["A-01", "A-02"], false), mark("b.rs", &["A-01", "A-02"], true)];
    assert_eq!(faults(&list, &whole, &[]), ["A-02: none is not recorded"]);
    assert_eq!(faults(&list[..1], &whole[..1], &[]).len(), 2, "no test, and an id of none");
    let marks = [mark("a.rs", &["A-01"], true), mark("b.rs", &[], true)];
    let found = faults(&list[..1], &marks, &[]);
    assert_eq!(found, ["A-01: no source implements it", "b.rs: tests of no requirement"]);
    let core = [
        mark("a/mod.rs", &["A-01"], false),
        mark("a/b.rs", &[], false),
        mark("a/b/c.rs", &[], false),
        mark("a/tests.rs", &["A-01"], true),
    ];
    let found = faults(&list[..1], &core, &[]);
    assert_eq!(found, ["a/b/c.rs: neither it nor the head of its folder names a requirement"]);
    let is_by_head = |mark: &Mark| !mark.is_test && mark.ids.is_empty();
    assert!(self::marks().iter().any(is_by_head), "files of the core without ids are read");
}

//! Pages for a device's file: assumptions of use, anomalies, and an index by clause. `DIBS_WRITE=1` writes them again.
//!
//! These fail: a missing check of an assumption, a variant that does not exist, a missing file or figure of an anomaly,
//! an id that is used twice, and a page of the index that does not exist.

// Requirement: E-03

mod anomalies;
mod assumptions;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;

use self::anomalies::{ANOMALIES, Anomaly};
use self::assumptions::{ASSUMPTIONS, Assumption, Check};
use crate::failures::sources::{STRUCTS, enums, variants};
use crate::page::{self, REPOSITORY};

const NOTE: &str = "**Nothing here is certified, and no certification is claimed.**\n";
const WRITTEN: &str =
    "Written by `DIBS_WRITE=1 cargo test -p dibs-tests --test pages`: do not edit. The list is";

#[test]
fn assumptions_name_their_checks() {
    let mut enums = enums();
    enums.insert("ToolError".to_owned(), variants("ToolError", "tool/mod.rs"));
    let mut ids = BTreeSet::new();
    let mut text = format!(
        "# Assumptions of use\n\n{WRITTEN}\n[assumptions.rs](../../tests/tests/pages/device/assumptions.rs).\n\n{NOTE}\n\
         | id | assumed | checked at run time |\n|---|---|---|\n"
    );
    for Assumption { id, says, check } in ASSUMPTIONS {
        assert!(ids.insert(id), "{id} is listed twice");
        let cell = match check {
            Check::Yours(hint) => format!("not checked: yours. {hint}"),
            Check::By { file, function, outcome } => {
                let source =
                    fs::read_to_string(Path::new(REPOSITORY).join("dibs-nostd/src").join(file));
                let source = source.unwrap_or_else(|_| panic!("{id}: no {file}"));
                let has = |after: &str| source.contains(&format!("fn {function}{after}"));
                assert!(has("(") || has("<"), "{id}: no {function} in {file}");
                let made = outcome.rsplit("::").next().unwrap_or_default();
                assert!(source.contains(made), "{id}: {file} never makes {outcome}");
                let is_there = match outcome.split_once("::") {
                    Some((error, variant)) => {
                        enums.get(error).is_some_and(|all| all.contains_key(variant))
                    }
                    None => STRUCTS.contains(outcome),
                };
                assert!(is_there, "{id}: no {outcome}");
                format!("`{function}` in [{file}](../../dibs-nostd/src/{file}): `{outcome}`")
            }
        };
        let _ = writeln!(text, "| {id} | {says} | {cell} |");
    }
    page::keep("assumptions.md", &text);
}

#[test]
fn anomalies_have_a_place() {
    let records = page::records("guarantees.json");
    let mut ids = BTreeSet::new();
    let mut text = format!(
        "# Known anomalies\n\n{WRITTEN}\n[anomalies.rs](../../tests/tests/pages/device/anomalies.rs). Figures are those of \
         [guarantees.md](guarantees.md).\nWhat is no goal is in the README, under \"What it does not do\".\n\n{NOTE}\n\
         | id | anomaly | remedy | where |\n|---|---|---|---|\n"
    );
    for Anomaly { id, says, remedy, file } in ANOMALIES {
        assert!(ids.insert(id), "{id} is listed twice");
        assert!(Path::new(REPOSITORY).join(file).is_file(), "{id}: no {file}");
        if says.contains("{commits}") && commits(&records) == 1 {
            continue;
        }
        let says = filled(says, &records).unwrap_or_else(|figure| panic!("{id}: no {figure}"));
        let name = file.rsplit('/').next().unwrap_or(file);
        let _ = writeln!(text, "| {id} | {says} | {remedy} | [{name}](../../{file}) |");
    }
    page::keep("anomalies.md", &text);
}

/// A text with figures in place of their ids.
fn filled(says: &str, records: &[Value]) -> Result<String, String> {
    let mut parts = says.split('{');
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (id, rest) = part.split_once('}').ok_or("}")?;
        let figure = if id == "commits" {
            commits(records).to_string()
        } else {
            let record = records.iter().find(|record| record["id"] == id);
            number(record.and_then(|record| record["figure"].as_f64()).ok_or(id)?)
        };
        text += &figure;
        text += rest;
    }
    Ok(text)
}

/// The number of commits whose figures these are.
fn commits(records: &[Value]) -> usize {
    let commits = records.iter().filter_map(|record| record["run"]["commit"].as_str());
    commits.collect::<BTreeSet<_>>().len()
}

/// Whole numbers from 100 on, otherwise two decimals.
fn number(value: f64) -> String {
    if value >= 100.0 {
        return page::thousands(value.round() as u32);
    }
    let digits = if value >= 1.0 { 1 } else { 3 };
    format!("{value:.digits$}")
}

/// A name and a path from `docs/evidence`.
type Page = (&'static str, &'static str);

/// A clause of IEC 62304:2006+A1:2015, its subject, and the pages for it.
const CLAUSES: [(&str, &str, &[Page]); 5] = [
    (
        "5.3.3",
        "functional and performance requirements of a software item of unknown provenance",
        &[
            ("requirements with their tests", "requirements.md"),
            ("figures and bounds", "guarantees.md"),
            ("bound on instructions", "bound.md"),
        ],
    ),
    (
        "5.3.4",
        "hardware and software that such an item needs",
        &[
            ("assumptions of use", "assumptions.md"),
            ("processors", "../processors.md"),
            ("boards", "../boards.md"),
            ("memory, limits and budget", "../guide.md"),
        ],
    ),
    (
        "7.1.2",
        "causes that may contribute to a hazardous situation",
        &[
            ("failures of every call", "failures.md"),
            ("assumptions of use", "assumptions.md"),
            ("errors of the bus", "../black-channel.md"),
            ("strangers", "../../SECURITY.md"),
        ],
    ),
    (
        "7.1.3",
        "published lists of anomalies",
        &[("known anomalies", "anomalies.md"), ("changes", "../../CHANGELOG.md")],
    ),
    (
        "8.1.2",
        "identification: title, manufacturer, version",
        &[
            ("public items", "public-api.txt"),
            ("bill of materials of the core", "sbom/core.cdx.json"),
            ("of the firmware", "sbom/firmware.cdx.json"),
            ("of the program `dibs`", "sbom/program.cdx.json"),
            ("bytes of a tree", "../format.md"),
            ("bytes on the bus", "../wire.md"),
        ],
    ),
];

#[test]
fn the_index_leads_to_pages() {
    let mut text = format!(
        "# Index for a device's file\n\n{WRITTEN}\n[device/mod.rs](../../tests/tests/pages/device/mod.rs). It is a help for a reader who \
         describes this library as a software item\nof unknown provenance (IEC 62304:2006+A1:2015).\n\n{NOTE}\n\
         | clause | about | pages |\n|---|---|---|\n"
    );
    for (clause, about, pages) in CLAUSES {
        let links = pages.iter().map(|(name, page)| {
            let path = Path::new(REPOSITORY).join("docs/evidence").join(page);
            assert!(path.is_file(), "{clause}: no {page}");
            format!("[{name}]({page})")
        });
        let _ = writeln!(text, "| {clause} | {about} | {} |", links.collect::<Vec<_>>().join(", "));
    }
    page::keep("device.md", &text);
}

#[test]
fn a_figure_that_is_not_recorded_is_found() {
    assert_eq!(filled("{commits} and {none} of", &[]), Err("none".to_owned()));
}

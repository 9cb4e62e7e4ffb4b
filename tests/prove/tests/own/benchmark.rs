//! The benchmark itself: it runs, its methods agree, and its documents are those of its records.

use std::path::Path;

use dibs_prove::paper::plan::{Options, Plan};
use dibs_prove::paper::record::Records;
use dibs_prove::paper::{documents, run, write};
use xtask::workspace;

#[test]
fn every_experiment_runs_and_all_methods_agree() {
    let records = run(&Plan::smoke(), &Options::default()).expect("methods agree");
    for experiment in ["brain", "heart", "ablation", "compare", "crossover", "histogram"] {
        let count = records.0.iter().filter(|r| r.experiment == experiment).count();
        assert!(count > 10, "{experiment}: {count} records");
    }
    let back: serde_json::Value =
        serde_json::from_str(&records.json().expect("numbers are finite")).expect("valid JSON");
    assert_eq!(back.as_array().map(Vec::len), Some(records.0.len()));
    let folder = tempfile::tempdir().expect("a folder");
    write(&records, folder.path()).expect("a writable folder");
    assert_eq!(Records::read(&folder.path().join("benchmarks.json")).expect("readable"), records);
    check(folder.path());
}

#[test]
fn the_committed_documents_are_what_the_committed_records_say() {
    check(&workspace::root().join("docs"));
}

/// Every document of a folder is the one that its records give.
fn check(folder: &Path) {
    let records = Records::read(&folder.join("benchmarks.json")).expect("readable");
    for (name, expected) in documents(&records).expect("drawable") {
        let path = folder.join(&name);
        let found = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(found == expected, "{name} is not made from benchmarks.json: run with --render");
    }
}

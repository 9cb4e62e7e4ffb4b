//! The page of coverage: what was counted, and the reasons for what no test executes.

// Requirement: E-06

use std::fs;
use std::path::Path;

use dibs_prove::coverage::export::Counts;
use dibs_prove::coverage::reasons::Reason;
use dibs_prove::coverage::record::Record;
use dibs_prove::coverage::{RECORD, measure, own_tests, page};
use xtask::workspace;

use super::records::run;

#[test]
fn every_reason_is_of_a_place_and_the_page_shows_record_and_reasons() {
    let evidence = workspace::root().join("docs/evidence");
    let record = Record::read(&evidence.join(RECORD)).expect("a record");
    let reasons = Reason::read().expect("reasons");
    for reason in &reasons {
        let stale: Vec<_> = reason.stale(&record.open).collect();
        assert!(stale.is_empty(), "executed, or gone: {stale:?} ({})", reason.because);
    }
    let shown = fs::read_to_string(evidence.join("coverage.md")).expect("a page");
    assert!(shown == page::page(&record, &reasons), "`cargo xtask coverage --page` writes it anew");
}

/// As `llvm-cov` exports them: the conditions in two instances of the function.
#[test]
fn an_export_is_read_by_lines_and_outcomes() {
    let source = "fn a(b: u32) {\n    if b > 1 {\n        c();\n    }\n    d();\n    if b > 2 {\n        e();\n    }\n}\n\n#[cfg(test)]\nmod tests {\n    fn f() {}\n}\n";
    // Line 3 is not executed; the other condition has both outcomes in the instances together.
    let file = r#"{"filename":"a.rs","branches":[[2,8,2,13,0,5,0,0,4],[6,8,6,13,2,0,0,0,4],[6,8,6,13,0,1,0,0,4]],
        "segments":[[1,1,5,true,true,false],[2,14,0,true,true,false],[4,6,5,true,true,false],[6,14,2,true,true,false],
        [8,6,5,true,false,false],[9,2,0,false,false,false],[13,5,0,true,true,false],[13,14,0,false,false,false]]}"#;
    let mut counts = Counts::default();
    counts.add(&serde_json::from_str(file).expect("a file"));
    let mut record = Record::new(run("a"));
    record.add("a.rs", &counts, source);
    let sums = record.sums();
    assert_eq!((sums.statements, sums.branches, sums.regions), ([5, 6], [3, 4], [3, 4]));
    let open: Vec<_> = record.open.iter().map(|one| (one.number, one.condition.clone())).collect();
    assert_eq!(open, [(3, None), (2, Some(("b > 1".to_owned(), true)))]);
}

#[test]
fn tests_do_not_count() {
    let source = "fn one() {}\n\n#[cfg(test)]\nmod tests {\n    fn two() {\n    }\n}\n\nimpl A {\n    #[cfg(test)]\n    fn b() {\n    }\n    fn c() {}\n}\n#[cfg(test)]\nmod more;\nfn d() {}\n";
    let lines: Vec<u32> = own_tests::lines(source).into_iter().collect();
    assert_eq!(lines, [3, 4, 5, 6, 7, 10, 11, 12, 15, 16]);
    let is_test = |file: &str| own_tests::is_test(&measure::core().join(Path::new(file))).unwrap();
    assert!(is_test("query/tracker/tests.rs") && is_test("query/search/range/tests.rs"));
    assert!(
        is_test("query/distances.rs") && !is_test("query/tracker/kept.rs") && !is_test("lib.rs")
    );
}

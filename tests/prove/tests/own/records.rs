//! Records say of when they are, and golden figures do not creep.

// Requirements: E-01, E-02

use std::fs;

use dibs_prove::harness::figures::Figures;
use dibs_prove::harness::promise::Bound;
use dibs_prove::harness::record::{Raise, Record, committed, has, json, merge, promises, whole};
use dibs_prove::harness::run::{Run, UNKNOWN};
use dibs_prove::harness::{Measured, markdown};

fn golden() -> &'static str {
    let golden = promises().find(|(_, promise)| matches!(promise.bound, Bound::Golden));
    golden.expect("a golden figure").1.id
}

pub fn run(commit: &str) -> Run {
    let [date, compiler, machine, emulator] =
        ["2026-01-01T00:00Z", "rustc", "a machine", "QEMU"].map(str::to_owned);
    Run { date, commit: commit.to_owned(), compiler, machine, emulator, size: "full".into() }
}

fn measured(commit: &str, figures: &[(&str, f64)]) -> Measured {
    let mut noted = Figures::default();
    figures.iter().for_each(|&(id, value)| noted.note(id, value));
    Measured { figures: noted, skipped: Vec::new(), run: run(commit) }
}

fn value(records: &[Record], id: &str) -> f64 {
    records.iter().find(|record| record.id == id).expect("a record").figure.as_f64().unwrap()
}

/// 4 % at every recording: with the figure before it as the measure, all of them would pass.
#[test]
fn a_golden_figure_does_not_creep_from_recording_to_recording() {
    let id = golden();
    let mut records = Vec::new();
    let mut refused = 0;
    for figure in [100.0, 104.0, 108.0, 112.0] {
        let (after, broken) = merge(&records, &measured("a", &[(id, figure)]), Raise::default());
        refused += broken.len();
        records = after;
    }
    assert_eq!((refused, value(&records, id)), (2, 104.0));
    let names = [id.to_owned()];
    let raise = Raise { names: &names, because: "a defect was mended" };
    let (after, broken) = merge(&records, &measured("a", &[(id, 112.0)]), raise);
    assert!(broken.is_empty(), "{broken:?}");
    assert_eq!(after[0].raised, "raised from 100: a defect was mended");
    let (_, broken) = merge(&after, &measured("a", &[(id, 116.0)]), Raise::default());
    assert!(broken.is_empty(), "{broken:?}");
}

/// All promises of one commit, but for those of one check.
#[test]
fn a_partial_recording_does_not_pass_for_a_whole_one() {
    let all: Vec<(&str, f64)> = promises().map(|(_, promise)| (promise.id, 1.0)).collect();
    let (whole, _) = merge(&[], &measured("aaaa", &all), Raise::default());
    let head = |records: &[Record]| {
        let text = markdown::render(records).expect("text");
        text.split("\n| promise |").next().expect("a head").to_owned()
    };
    assert!(head(&whole).contains("All of it was measured at commit `aaaa`"));
    assert!(!head(&whole).contains("NOT OF ONE"));

    let (partial, _) = merge(&whole, &measured("bbbb", &all[..3]), Raise::default());
    assert!(head(&partial).contains("NOT OF ONE"), "{}", head(&partial));
    for commit in ["aaaa", "bbbb"] {
        assert!(head(&partial).contains(&format!("`{commit}`")), "{}", head(&partial));
    }
    // Rows of the commit that is not the last say so.
    let text = markdown::render(&partial).expect("text");
    let of_old = text.matches("(`aaaa`,").count();
    let rows = partial.iter().filter(|r| r.run.commit == "aaaa" && r.is_shown()).count();
    assert_eq!(of_old, rows);

    assert!(head(&whole[1..]).contains("NOT OF ONE"), "{}", head(&whole[1..]));
    for commit in ["aaaa-dirty", UNKNOWN] {
        let (records, _) = merge(&[], &measured(commit, &all), Raise::default());
        assert!(head(&records).contains("NOT OF ONE"), "{commit}");
    }
}

/// Figures that keep their bounds, one of them left out, and one that breaks a bound: its own, another figure, a record.
#[test]
fn the_records_of_a_whole_run_are_of_no_other() {
    let whole_of = |before: &[Record], other: Option<(&str, f64)>| {
        let kept = promises().map(|(_, promise)| match promise.bound {
            _ if other.is_some_and(|(id, _)| id == promise.id) => (promise.id, other.unwrap().1),
            Bound::Is(value) | Bound::AtMost(value) | Bound::AtLeast(value) => (promise.id, value),
            _ => (promise.id, 1.0),
        });
        let kept: Vec<_> = kept.filter(|(_, figure)| !figure.is_nan()).collect();
        whole(before, &measured("aaaa", &kept), Raise::default())
    };
    let (old, _) = merge(&[], &measured("bbbb", &[("filter.ticks", 1.0)]), Raise::default());
    let records = whole_of(&old, None).expect("all kept");
    assert!(records.iter().all(|record| record.run.commit == "aaaa"));
    assert_eq!(records.len(), promises().count());
    for (id, figure, says) in [
        ("filter.ticks", f64::NAN, "a filter on this computer: no filter.ticks"),
        ("filter.violations", 1.0, "filter.violations is 1.0, and must be 0"),
        ("stack.measured", 1e9, "stack.measured is 1000000000.0, and must be not above"),
        ("m7.warm.mean", 1e9, "the lowest recorded"),
    ] {
        let error = whole_of(&records, Some((id, figure))).expect_err(id).to_string();
        assert!(error.contains(says), "{error}");
    }
}

/// A run that was stopped after half of a check's figures.
#[test]
fn a_check_is_recorded_once_all_of_its_figures_are_of_the_run() {
    let (check, _) = promises().find(|(check, _)| check.promises.len() > 2).expect("a check");
    let all: Vec<(&str, f64)> = check.promises.iter().map(|promise| (promise.id, 1.0)).collect();
    let (half, _) = merge(&[], &measured("aaaa", &all[1..]), Raise::default());
    let (whole, _) = merge(&half, &measured("aaaa", &all[..1]), Raise::default());
    let (mixed, _) = merge(&whole, &measured("bbbb", &all[..1]), Raise::default());
    let recorded = [&half, &whole, &mixed].map(|records| has(records, check, &run("aaaa")));
    assert_eq!(recorded, [false, true, false]);
    let smaller = Run { size: "1/10".into(), ..run("aaaa") };
    let later = Run { date: "2026-01-02T00:00Z".into(), ..run("aaaa") };
    assert_eq!([smaller, later].map(|run| has(&whole, check, &run)), [false, true]);
}

/// The committed head, read by itself, against the committed rows.
#[test]
fn the_committed_head_says_what_the_rows_say() {
    let records = committed().expect("records");
    let text = fs::read_to_string(json().with_extension("md")).expect("a document");
    assert!(
        text == markdown::render(&records).expect("text"),
        "docs/evidence/guarantees.md is not made from guarantees.json: run `cargo xtask guarantees --render`"
    );
    let says_whole = text.contains("All of it was measured at commit");
    let mut commits: Vec<&str> = records.iter().map(|r| r.run.commit.as_str()).collect();
    commits.sort_unstable();
    commits.dedup();
    let is_whole = commits.len() == 1
        && records.iter().all(|r| r.run.size != "test" && !r.run.commit.contains("-dirty"))
        && promises().all(|(_, promise)| records.iter().any(|r| r.id == promise.id));
    assert!(!says_whole || is_whole, "the head says more than the rows: {commits:?}");
    assert!(commits.iter().all(|commit| text.contains(&format!("`{commit}`"))), "{commits:?}");
}

/// A search at full size stays beside the smaller one of a release, and of a second release, until it is made again.
#[test]
fn a_larger_search_is_kept_beside_a_smaller_one() {
    let id = "filter.violations";
    let of = |commit: &str, size: &str, ticks: f64| {
        let mut measured =
            measured(commit, &[(id, 0.0), ("filter.ticks", ticks), ("m7.warm.mean", 5.0)]);
        measured.run.size = size.into();
        measured
    };
    let mut records = Vec::new();
    for (commit, size, ticks, kept) in [
        ("aaaa", "full", 9_000.0, None),
        ("bbbb", "1/50", 180.0, Some("aaaa")),
        ("cccc", "1/50", 180.0, Some("aaaa")),
        ("dddd-dirty", "full", 8_000.0, None),
        ("eeee", "1/50", 180.0, None),
        ("ffff", "full", 7_000.0, None),
        ("gggg", "1/50", 180.0, Some("ffff")),
    ] {
        let (after, broken) = merge(&records, &of(commit, size, ticks), Raise::default());
        assert!(broken.is_empty(), "{broken:?}");
        records = after;
        let larger = |id| records.iter().find(|record| record.id == id).unwrap().larger.as_ref();
        assert_eq!(larger(id).map(|search| search.run.commit.as_str()), kept, "{commit}");
        assert_eq!(larger("m7.warm.mean"), None);
    }
    let text = markdown::render(&records).expect("text");
    assert!(text.contains("In a larger search 0 of 7,000 ticks"), "{text}");
}

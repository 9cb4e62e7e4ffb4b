//! Evidence is of one run: on a list of parts that take no time.

// Requirement: E-02

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

use anyhow::{Result, bail};
use dibs_prove::evidence::pages::{Writer, seconds, write};
use dibs_prove::evidence::parts;
use dibs_prove::evidence::runner::{FILES, Part, Place, measure};
use dibs_prove::harness::run::Run;
use tempfile::TempDir;
use xtask::steps::Outcome;

use super::records::run;

/// Parts that write a page each, and note that they were measured.
struct Fake {
    folder: TempDir,
    measured: Arc<Mutex<Vec<&'static str>>>,
    faulty: Arc<Mutex<BTreeSet<&'static str>>>,
    parts: Vec<Part>,
}

impl Fake {
    fn new(faulty: &[&'static str]) -> Self {
        let measured = Arc::new(Mutex::new(Vec::new()));
        let faulty = Arc::new(Mutex::new(faulty.iter().copied().collect::<BTreeSet<_>>()));
        let parts = [
            ("a", Place::Emulator),
            ("b", Place::Emulator),
            ("c", Place::Beside),
            ("d", Place::Either),
            ("e", Place::Alone),
        ];
        let parts = parts.map(|(name, place)| {
            let (measured, faulty) = (Arc::clone(&measured), Arc::clone(&faulty));
            Part::new(name, place, move |folder| {
                measured.lock().unwrap().push(name);
                let is_faulty = faulty.lock().unwrap().contains(name);
                match name {
                    "b" if is_faulty => bail!("no board"),
                    "c" if is_faulty => panic!("no index"),
                    "e" if is_faulty => return Ok(Outcome::Skipped("no network".to_owned())),
                    _ => (),
                }
                fs::write(folder.join(FILES).join(format!("{name}.md")), "# A page\n")?;
                Ok(Outcome::Passed)
            })
        });
        let folder = tempfile::tempdir().expect("a folder");
        Self { folder, measured, faulty, parts: parts.into() }
    }

    /// The names of the parts that were measured at a commit, and the error.
    fn measure(&self, commit: &str) -> (Vec<&'static str>, String) {
        let result = measure(&self.parts, self.folder.path(), &|| run(commit));
        let mut measured = std::mem::take(&mut *self.measured.lock().unwrap());
        measured.sort_unstable();
        (measured, said(result))
    }

    /// Writes the pages. Returns the error.
    fn write(&self, commit: &str, writers: &[Writer]) -> String {
        said(write(&self.parts, writers, self.folder.path(), &|| run(commit)))
    }

    fn page(&self, name: &str) -> Option<String> {
        fs::read_to_string(self.folder.path().join("pages").join(name)).ok()
    }
}

fn said(result: Result<()>) -> String {
    result.err().map_or_else(String::new, |error| format!("{error:#}"))
}

#[test]
fn the_pages_of_a_whole_run_say_of_which_it_is() {
    let fake = Fake::new(&["e"]);
    assert_eq!(fake.measure("aaaa"), (vec!["a", "b", "c", "d", "e"], String::new()));
    let index = |pages: &Path| Ok(fs::write(pages.join("index.md"), "# Of sources\n")?);
    let writers = [Writer { name: "index", write: Box::new(index) }];
    assert_eq!(fake.write("aaaa", &writers), "");
    let Run { date, machine, .. } = run("aaaa");
    for page in ["a.md", "b.md", "c.md", "d.md", "run.md"] {
        let text = fake.page(page).expect(page);
        let says = |what: &str| text.matches(what).count() == 1;
        assert!(says("`aaaa`") && says(&date) && says(&machine), "{text}");
    }
    assert_eq!(fake.page("index.md").as_deref(), Some("# Of sources\n"));
    assert!(fake.page("run.md").expect("a page").contains("| e (no network) |"));
}

/// The time of a run, in which parts are beside and within each other, and which may have been interrupted.
#[test]
fn what_two_lanes_take_counts_once() {
    let of = |spans: &[[f64; 2]]| seconds(spans.iter().copied()).to_bits();
    assert_eq!(of(&[[30.0, 31.0], [0.0, 10.0], [5.0, 20.0]]), 21.0_f64.to_bits());
    assert_eq!(of(&[[0.0, 10.0], [2.0, 3.0], [4.0, 12.0]]), 12.0_f64.to_bits());
}

#[test]
fn an_interrupted_run_measures_only_what_is_missing() {
    let fake = Fake::new(&["b", "c"]);
    let (measured, error) = fake.measure("aaaa");
    assert_eq!(measured, ["a", "b", "c", "d", "e"]);
    assert!(error.starts_with("2 of 5 parts failed"), "{error}");
    assert!(error.contains("b: no board") && error.contains("c: panicked: no index"), "{error}");
    let error = fake.write("aaaa", &[]);
    assert!(error.contains("of commit aaaa are missing b, c") && fake.page("a.md").is_none());

    fake.faulty.lock().unwrap().clear();
    assert_eq!(fake.measure("aaaa"), (vec!["b", "c"], String::new()));
    assert_eq!(fake.measure("aaaa"), (Vec::new(), String::new()));
    assert_eq!(fake.write("aaaa", &[]), "");
}

#[test]
fn no_page_is_of_two_commits() {
    let fake = Fake::new(&["b"]);
    fake.measure("aaaa");
    fake.faulty.lock().unwrap().clear();
    // What was measured at the commit before does not count.
    assert_eq!(fake.measure("bbbb"), (vec!["a", "b", "c", "d", "e"], String::new()));
    assert_eq!(fake.write("bbbb", &[]), "");
    assert!(fake.write("aaaa", &[]).contains("are missing a, b, c, d, e"));
    assert!(fake.page("a.md").is_none(), "pages of the commit before");

    measure(&fake.parts[..1], fake.folder.path(), &|| run("cccc")).expect("one part");
    for (commit, missing) in [("bbbb", "missing a"), ("cccc", "missing b, c, d, e")] {
        let error = fake.write(commit, &[]);
        assert!(error.contains("no page") && error.contains(missing), "{error}");
        assert!(fake.page("a.md").is_none());
    }
}

#[test]
fn an_unclean_checkout_is_refused() {
    let fake = Fake::new(&[]);
    let (measured, error) = fake.measure("aaaa-dirty");
    assert!(measured.is_empty() && error.contains("commit or stash"), "{error}");
    assert!(fake.write("aaaa-dirty", &[]).contains("commit or stash"));
}

/// Somebody commits while parts run, or while a page is written.
#[test]
fn a_commit_meanwhile_is_noticed() {
    let fake = Fake::new(&[]);
    let count = Mutex::new(0);
    let moving = || {
        let mut count = count.lock().unwrap();
        *count += 1;
        run(&format!("commit {count}"))
    };
    let error = said(measure(&fake.parts, fake.folder.path(), &moving));
    assert!(error.starts_with("5 of 5") && error.contains("changed meanwhile"), "{error}");

    assert_eq!(fake.measure("aaaa").1, "");
    let calls = Mutex::new(["bbbb", "aaaa"].to_vec());
    let commits = || run(calls.lock().unwrap().pop().expect("two calls"));
    let error = said(write(&fake.parts, &[], fake.folder.path(), &commits));
    assert!(error.contains("the checkout changed") && fake.page("a.md").is_none(), "{error}");
}

/// A bound that is broken by figures of two checks, for one.
#[test]
fn a_writer_that_fails_leaves_no_page() {
    let fake = Fake::new(&[]);
    fake.measure("aaaa");
    let broken = || Writer { name: "guarantees", write: Box::new(|_| bail!("a broken bound")) };
    let error = fake.write("aaaa", &[broken()]);
    assert!(error.contains("guarantees: a broken bound") && fake.page("a.md").is_none());
}

#[test]
fn each_part_has_a_folder() {
    let parts = parts::all().expect("parts");
    let folder = Path::new("");
    let folders: BTreeSet<_> = parts.iter().map(|part| part.folder(folder)).collect();
    assert_eq!(folders.len(), parts.len());
}

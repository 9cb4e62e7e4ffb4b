//! `docs/evidence/sizes.md`: how large the project is, beside the goals of the restructuring that began at commit 354e5ea.
//! `DIBS_WRITE=1` writes it anew.
//!
//! Numbers with `~` are rounded and may differ from the page's by a twentieth: a commit that adds a function needs no new
//! page, one that adds a folder or a capability does.

// Requirement: E-04

mod lines;
mod ram;
mod steps;
mod twice;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{env, fs};

use crate::page::{evidence, keep, records, thousands};
use lines::{Lines, files, inside, is_product, is_source, place, read, sum};

const HEAD: &str = "# Sizes

How large the project is, beside the goals of the restructuring that began at commit 354e5ea: one house, one text for
each job. A program writes this page from the sources. Numbers with `~` are rounded: lines and words to hundreds, others
to tens. The page is old once one of them differs by more than a twentieth, and more than two such steps.
";

#[test]
fn the_page_shows_the_sizes_of_today() {
    let now = [HEAD, &goals(), &folders(), &rules(), &ram::table(), steps::TEXT].join("\n");
    let kept = fs::read_to_string(evidence("sizes.md")).unwrap_or_default();
    if env::var_os("DIBS_WRITE").is_some() {
        keep("sizes.md", &now);
    } else if let Some(place) = differs(&kept, &now) {
        panic!("{place}: write it anew with DIBS_WRITE=1");
    }
}

/// The first words that differ, unless they are rounded numbers that are nearly equal.
fn differs(kept: &str, now: &str) -> Option<String> {
    let (mut kept, mut now) = (kept.split_whitespace(), now.split_whitespace());
    loop {
        match (kept.next(), now.next()) {
            (None, None) => return None,
            (before, after) if before == after => (),
            (Some(before), Some(after)) if nearly(before, after) => (),
            (before, after) => return Some(format!("{before:?} on the page, {after:?} now")),
        }
    }
}

/// Whether both words are rounded numbers that differ by a twentieth at most, or two steps of the rounding.
fn nearly(before: &str, after: &str) -> bool {
    let number = |word: &str| {
        let word = word.trim_start_matches('(').strip_prefix('~')?;
        let word = word.trim_end_matches([')', ',', ';', '.', ':']);
        word.replace(',', "").parse::<u32>().ok()
    };
    let (Some(before), Some(after)) = (number(before), number(after)) else { return false };
    let is_some = before.is_multiple_of(100) && after.is_multiple_of(100);
    let step = if is_some { 100 } else { 10 };
    before.abs_diff(after) <= (before / 20).max(2 * step)
}

/// A number of lines or words, rounded to hundreds.
fn some(value: u32) -> String {
    format!("~{}", thousands(((value + 50) / 100).max(1) * 100))
}

/// A number of other things, rounded to tens.
fn few(value: u32) -> String {
    format!("~{}", thousands((value + 5) / 10 * 10))
}

#[test]
fn a_page_is_old_once_a_number_differs_by_a_twentieth() {
    assert_eq!([few(994), few(995), some(1_049), some(7)].join(" "), "~990 ~1,000 ~1,000 ~100");
    let page = |number: &str| format!("core {number}, in 3 files");
    let is_old = |before: &str, after: &str| differs(&page(before), &page(after)).is_some();
    for after in [33_700, 35_400, 37_100] {
        assert!(!is_old(&some(35_400), &some(after)), "{after}");
    }
    assert!(is_old(&some(35_400), &some(33_500)) && is_old(&some(35_400), &some(37_300)));
    assert!(!is_old(&some(500), &some(700)) && is_old(&some(500), &some(800)));
    assert!(!is_old(&few(30), &few(50)) && is_old(&few(30), &few(60)));
    assert!(!is_old("(~100),", "(~200),"));
    assert!(differs("4,864 bytes", "4,865 bytes").is_some());
    assert!(differs("core ~100", "core ~100 and").is_some());
}

/// Lines of the product below folders.
fn product(folders: &[&str]) -> Lines {
    sum(&folders.iter().map(|folder| place(folder)).collect::<Vec<_>>(), is_product)
}

/// The tests, checks and benchmarks that the goal counts.
const TESTS: [&str; 5] =
    ["tests", "dibs-build/tests", "dibs-stream/tests", "dibs-cli/tests", "bindings/c/tests"];

/// The builder's modules for motions, then for volumes of nodes.
const MOTIONS_AND_NODES: [&str; 9] = [
    "dibs-build/src/motion",
    "dibs-build/src/export.rs",
    "dibs-build/src/frames.rs",
    "dibs-build/src/frame_file.rs",
    "dibs-build/src/faces.rs",
    "dibs-build/src/nodes",
    "dibs-build/src/volume_file.rs",
    "dibs-build/src/read/volume.rs",
    "dibs-build/src/construct/embedded.rs",
];

/// Folders of the core that were not there at commit 354e5ea.
const NEW: [&str; 3] =
    ["dibs-nostd/src/guard", "dibs-nostd/src/control/filter", "dibs-nostd/src/nodes"];

fn goals() -> String {
    let core = product(&["dibs-nostd/src"]);
    let host = product(&["dibs-build/src", "dibs-stream/src", "dibs-cli/src"]);
    let [formats, generate, modes] = ["formats", "generate", "modes"].map(behind);
    let script = product(&["dibs-build/src"]).less(formats).less(generate).less(modes);
    let least = script.less(product(&MOTIONS_AND_NODES));
    let tests = sum(&TESTS.map(place), is_source);
    let mut text = "## Lines of Rust

Outside files and folders named tests, but for the last row. *Code* is without comments and blank lines.

| | goal | 354e5ea | code | today | code |
|---|---:|---:|---:|---:|---:|
"
    .to_owned();
    for (name, goal, start, Lines { all, code }) in [
        ("the core", 16_500, "22,032 | 15,930", core),
        ("builder, sender and program `dibs`", 14_500, "15,737 | 12,219", host),
        ("of these, what a build script compiles", 7_000, "– | –", script),
        ("tests, checks, benchmarks", 33_000, "38,300 | 32,477", tests),
    ] {
        let [goal, all, code] = [thousands(goal), some(all), some(code)];
        text.push_str(&format!("| {name} | {goal} | {start} | {all} | {code} |\n"));
    }
    let second = |folder, is_counted| {
        let runs = twice::below(folder, is_counted);
        let lines = runs.iter().map(|run| run.lines).sum();
        format!("{} pairs, {} lines", few(runs.len() as u32), few(lines))
    };
    let promises = records("guarantees.json");
    let promises = promises.iter().filter(|row| row["promise"] != "").count() as u32;
    let is_test = |line: &&str| line.trim() == "#[test]";
    let cases = files(&place("")).filter(|file| is_source(file));
    let cases = cases.map(|file| read(&file).lines().filter(is_test).count() as u32).sum();
    text.push_str(&format!(
        "
No goal is reached.

- **The core** also does what was not there: guard, filter and nodes are {new} of its lines. {comments} are documentation,
  comments and blank. *Tried:* merging. What stood several times is one text now ([below](#merged)); the runs of six lines
  and more that still stand twice are {core_runs}. No merge leads to the goal, only fewer capabilities.
- **A build script** compiles nothing behind the features `generate` ({generate}), `formats` ({formats}) and `modes`
  ({modes}). *Considered:* two more, for motions and for nodes. They would leave {least_all} lines, {least_code} of code,
  still above the goal, and a script that needs one would have to name it. What is left reads meshes, checks them, and
  builds and writes trees.
- **The tests** are {cases} where 476 were, and show {promises} promises where 91 were. *Tried:* merging, too: of their
  runs, {test_runs} stand twice.
",
        new = some(product(&NEW).all),
        comments = some(core.all - core.code),
        core_runs = second("dibs-nostd/src", is_product),
        generate = some(generate.all),
        formats = some(formats.all),
        modes = some(modes.all),
        least_all = some(least.all),
        least_code = some(least.code),
        cases = few(cases),
        promises = few(promises),
        test_runs = second("tests", is_source),
    ));
    text
}

/// Lines of the builder's modules behind a feature.
fn behind(feature: &str) -> Lines {
    let mut modules = Vec::new();
    let gate = format!("#[cfg(feature = \"{feature}\")]\n");
    for file in files(&place("dibs-build/src")).filter(|file| is_product(inside(file))) {
        let text = read(&file);
        for item in text.split(&gate).skip(1) {
            let line = item.lines().next().unwrap_or_default().trim_start_matches("pub ");
            let Some(name) = line.strip_prefix("mod ").and_then(|name| name.strip_suffix(';'))
            else {
                continue;
            };
            let folder = file.parent().expect("a folder");
            let module = [folder.join(name), folder.join(format!("{name}.rs"))];
            modules.extend(module.into_iter().filter(|module| module.exists()));
        }
    }
    sum(&modules, is_product)
}

/// Lines by crate and folder.
fn folders() -> String {
    let mut text = "## By folder\n\n| | lines | code | of them |\n|---|---:|---:|---|\n".to_owned();
    for (root, is_counted) in [
        ("dibs-nostd/src", is_product as fn(&Path) -> bool),
        ("dibs-nostd/src/query", is_product),
        ("dibs-build/src", is_product),
        ("dibs-stream/src", is_product),
        ("dibs-cli/src", is_product),
        ("bindings/c/src", is_product),
        ("bindings/python/src", is_product),
        ("firmware-example/src", is_product),
        ("tests", is_source),
    ] {
        let Lines { all, code } = sum(&[place(root)], is_counted);
        let mut parts: BTreeMap<String, u32> = BTreeMap::new();
        for file in files(&place(root)).filter(|file| is_counted(inside(file))) {
            let below = file.strip_prefix(place(root)).expect("below");
            let mut names = below.iter().map(|name| name.to_string_lossy());
            let (first, is_folder) = (names.next().expect("a name"), names.next().is_some());
            let name = if is_folder { format!("`{first}`") } else { "files".to_owned() };
            *parts.entry(name).or_default() += Lines::of(&read(&file)).all;
        }
        let parts: Vec<_> =
            parts.iter().map(|(name, lines)| format!("{name} {}", some(*lines))).collect();
        let (all, code, parts) = (some(all), some(code), parts.join(", "));
        text.push_str(&format!("| `{root}` | {all} | {code} | {parts} |\n"));
    }
    text
}

/// Extensions of the files whose length has a limit.
const KINDS: [&str; 9] = ["rs", "py", "c", "h", "hpp", "cpp", "mjs", "js", "html"];
const MOST_LINES: u32 = 400;
/// Lines of a file in which its reason may stand.
const HEAD_LINES: usize = 20;

/// The longer files that state a reason, and those that do not.
fn long_files() -> (u32, Vec<String>) {
    let (mut stated, mut bare) = (0, Vec::new());
    let is_limited =
        |file: &PathBuf| file.extension().is_some_and(|e| KINDS.iter().any(|k| e == *k));
    for file in files(&place("")).filter(is_limited) {
        let text = read(&file);
        match (Lines::of(&text).all > MOST_LINES, states_reason(&text)) {
            (true, true) => stated += 1,
            (true, false) => bare.push(inside(&file).display().to_string()),
            _ => (),
        }
    }
    (stated, bare)
}

fn states_reason(text: &str) -> bool {
    let mut head = text.lines().take(HEAD_LINES);
    head.any(|line| line.contains("One file, because ") || line.contains("/* Generated from "))
}

#[test]
fn a_file_above_400_lines_states_its_reason() {
    let (stated, bare) = long_files();
    assert!(stated > 10 && bare.is_empty(), "no reason at the head: {bare:?}");
    assert!(!states_reason(&("\n".repeat(HEAD_LINES) + "// One file, because of its end.")));
}

#[test]
fn no_six_lines_stand_twice_among_the_searches() {
    let runs = twice::below("dibs-nostd/src/query", is_product);
    let places: Vec<_> = runs.iter().map(|run| run.places.join(" and ")).collect();
    assert!(places.is_empty(), "{places:?}");
}

/// The pages of `docs/evidence` that people write.
const BY_HAND: [&str; 2] = ["docs/evidence/README.md", "docs/evidence/walks.md"];
const MOST_WORDS: u32 = 25_000;

/// Pages that have a limit of their own, and most words of each.
const LIMITED: [(&str, u32); 4] = [
    ("README.md", 1_200),
    ("ARCHITECTURE.md", 2_500),
    ("docs/guide.md", 2_500),
    ("CHANGELOG.md", 1_500),
];

/// Words of Markdown by hand.
fn words() -> u32 {
    let is_by_hand = |file: &PathBuf| {
        let path = inside(file);
        let is_listed = BY_HAND.iter().any(|page| path == Path::new(page));
        file.extension().is_some_and(|kind| kind == "md")
            && (is_listed || !path.starts_with("docs/evidence"))
    };
    files(&place("")).filter(is_by_hand).map(|page| words_of(&page)).sum()
}

/// Words of a page. A word has a letter or a digit.
fn words_of(page: &Path) -> u32 {
    let is_word = |word: &&str| word.contains(char::is_alphanumeric);
    read(page).split_whitespace().filter(is_word).count() as u32
}

#[test]
fn the_pages_by_hand_have_at_most_25_000_words() {
    let words = words();
    assert!((20_000..=MOST_WORDS).contains(&words), "{words} words");
}

#[test]
fn four_pages_keep_limits_of_their_own() {
    for (page, most) in LIMITED {
        let words = words_of(&place(page));
        assert!((most / 3..=most).contains(&words), "{page}: {words} words");
    }
}

/// What the tests of this folder hold.
fn rules() -> String {
    let listed = read(&place("docs/evidence/public-api.txt"));
    let items =
        |name: &str| listed.lines().filter_map(|l| l.strip_prefix(name)).collect::<Vec<_>>();
    let core = items("dibs_nostd::");
    let root = core.iter().filter(|item| !item.contains("::")).count();
    let (core, builder, sender) =
        (core.len(), items("dibs_build::").len(), items("dibs_stream::").len());
    format!(
        "## Rules\n\nThe tests of this page, of public items and of imports between folders hold them.\n
- No file above {MOST_LINES} lines lacks a reason at its head: {stated} have one.
- No six lines of code stand twice among the searches (`query/`). The head of a function counts as one line: `take_pair`
  and `take_tied`, `beyond` and `vertices_within`, `test_children` and `test_triangles` have the same parameters, each of
  them used, and a tuple would only hide that.
- Markdown by hand has {words} words, at most {most}: those with a letter or digit, code and tables included, in every page
  that no program writes. At 354e5ea there were 62,000 of Markdown, half of them by hand.
- Each of the {root} public items of the core's root is in an example or a product; its modules have {inner} more (129 in
  all at 354e5ea), builder and sender {builder} and {sender}.
",
        stated = few(long_files().0),
        words = some(words()),
        most = thousands(MOST_WORDS),
        inner = core - root,
    )
}

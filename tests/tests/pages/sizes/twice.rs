//! Finds runs of lines that stand twice.

// Requirement: E-04

use std::collections::BTreeMap;
use std::path::Path;

use super::lines::{files, inside, place, read};

/// Fewest lines of a run.
const FEWEST: usize = 6;

/// A run of lines that stands in two places.
#[derive(Debug)]
pub struct Run {
    pub lines: u32,
    /// The files, and the numbers of the first lines.
    pub places: [String; 2],
}

/// A line of code, without its indentation, and its number.
type Line = (usize, String);

/// The runs that stand twice in the files that are counted, below a folder.
pub fn below(folder: &str, is_counted: fn(&Path) -> bool) -> Vec<Run> {
    let files = files(&place(folder)).filter(|file| is_counted(inside(file)));
    let sources = files.map(|file| (inside(&file).display().to_string(), code(&read(&file))));
    runs(&sources.collect::<Vec<_>>())
}

/// The lines of code: no comments, imports and unit tests. The head of a function is one line, because functions of one
/// kind have the same parameters.
fn code(text: &str) -> Vec<Line> {
    let (mut found, mut head): (Vec<Line>, Option<Line>) = (Vec::new(), None);
    let product = text.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    for (number, line) in (1..).zip(product.lines().map(str::trim)) {
        if line.is_empty() || ["//", "use ", "pub use "].iter().any(|start| line.starts_with(start))
        {
            continue;
        }
        let is_head = head.is_some() || line.split(' ').take(4).any(|word| word == "fn");
        let (number, text) = match head.take() {
            Some((number, before)) => (number, format!("{before} {line}")),
            None => (number, line.to_owned()),
        };
        if is_head && !line.ends_with(['{', '}', ';']) {
            head = Some((number, text));
        } else {
            found.push((number, text));
        }
    }
    found
}

fn runs(sources: &[(String, Vec<Line>)]) -> Vec<Run> {
    let mut starts: BTreeMap<Vec<&str>, Vec<(usize, usize)>> = BTreeMap::new();
    for (file, (_, lines)) in sources.iter().enumerate() {
        for (at, window) in lines.windows(FEWEST).enumerate() {
            let window = window.iter().map(|(_, line)| line.as_str()).collect();
            starts.entry(window).or_default().push((file, at));
        }
    }
    let line = |(file, at): (usize, usize)| sources[file].1.get(at).map(|(_, line)| line);
    let name =
        |(file, at): (usize, usize)| format!("{}:{}", sources[file].0, sources[file].1[at].0);
    let mut found = Vec::new();
    for places in starts.values() {
        for (number, &one) in places.iter().enumerate() {
            for &other in &places[number + 1..] {
                let begins_before = one.1 > 0
                    && other.1 > 0
                    && line((one.0, one.1 - 1)) == line((other.0, other.1 - 1));
                let overlaps = one.0 == other.0 && other.1 - one.1 < FEWEST;
                if begins_before || overlaps {
                    continue;
                }
                let agrees = |by: &usize| {
                    let next = line((one.0, one.1 + by));
                    next.is_some() && next == line((other.0, other.1 + by))
                };
                let lines = (0..).take_while(agrees).count() as u32;
                found.push(Run { lines, places: [name(one), name(other)] });
            }
        }
    }
    found
}

#[test]
fn a_run_that_stands_twice_is_found_once() {
    let run = "let a = 1;\nlet b = 2;\n// Why.\nlet c = 3;\n\nlet d = 4;\nlet e = 5;\nlet f = 6;\n";
    let source = |name: &str, text: String| (name.to_owned(), code(&text));
    let one = source("one", format!("fn one() {{\n{run}let g = 7;\n}}"));
    let other = source("other", format!("fn other(\n    a: u32,\n) {{\n{run}    let g = 8;\n}}"));
    let found = runs(&[one.clone(), other]);
    assert!(matches!(&found[..], [Run { lines: 6, .. }]), "{found:?}");
    let shorter = source("other", run.replace("let c = 3;", "let c = 4;"));
    assert!(runs(&[one, shorter]).is_empty());
    // Parameters alone are none.
    let head = |name: &str| {
        let parameters: String = (0..7).map(|number| format!("    p{number}: u32,\n")).collect();
        source(name, format!("pub fn {name}(\n{parameters}) -> u32 {{\n    {name}\n}}"))
    };
    assert!(runs(&[head("one"), head("other")]).is_empty());
}

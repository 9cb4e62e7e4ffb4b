//! The functions of the language's `core` that a tick executes, beside those of its certified subset.

// Requirement: A-06

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;

use anyhow::{Context, Result, bail};
use xtask::workspace;

use super::analysis::Analysis;

/// The subset, as it was read.
const SUBSET: &str = include_str!("core_subset.txt");

/// A function of `core` in the tick.
#[derive(Clone, Debug)]
pub struct Item {
    /// Below the folder of `core`.
    pub file: String,
    pub name: String,
    /// Instructions that are of it, or of what is inlined into it.
    pub instructions: usize,
    /// Whether it is in the subset; unknown if the list lacks it.
    pub is_certified: Option<bool>,
}

/// A line of the list.
struct Entry<'t> {
    place: (&'t str, &'t str),
    lines: Option<RangeInclusive<u32>>,
    /// None if the function is of another crate.
    is_certified: Option<bool>,
}

/// The functions of `core` in a graph, by file and name. One whose places differ counts as outside of the subset.
pub fn items(analysis: &Analysis) -> Result<Vec<Item>> {
    let entries: Vec<Entry<'_>> = SUBSET
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| entry(line).with_context(|| format!("core_subset.txt: {line}")))
        .collect::<Result<_>>()?;
    let mut found: BTreeMap<(String, String), Item> = BTreeMap::new();
    let functions = analysis.program.functions.values();
    let blocks = functions.flat_map(|function| &function.blocks);
    for at in blocks.flat_map(|block| block.instructions.iter().copied()) {
        for (file, line, name) in analysis.lines.of(at).iter().filter_map(|frame| frame.in_core()) {
            let entry = entries.iter().find(|entry| {
                entry.place == (file, name)
                    && entry.lines.as_ref().is_none_or(|lines| lines.contains(&line))
            });
            if entry.is_some_and(|entry| entry.is_certified.is_none()) {
                continue;
            }
            let place = (file.to_owned(), name.to_owned());
            let item = found.entry(place).or_insert_with(|| Item {
                file: file.to_owned(),
                name: name.to_owned(),
                instructions: 0,
                is_certified: Some(true),
            });
            item.instructions += 1;
            let is_certified = entry.and_then(|entry| entry.is_certified);
            item.is_certified = item.is_certified.and_then(|one| Some(one && is_certified?));
        }
    }
    // The debug information also has lines of `core` in functions that are not of it.
    let mut own = BTreeSet::new();
    for folder in ["dibs-nostd/src", "tests/probe/src"] {
        add_names(&workspace::root().join(folder), &mut own)?;
    }
    found.retain(|(_, name), item| item.is_certified.is_some() || !own.contains(name));
    Ok(found.into_values().collect())
}

/// Adds the names of the functions in a folder's sources.
fn add_names(folder: &Path, names: &mut BTreeSet<String>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            add_names(&path, names)?;
            continue;
        }
        let source = fs::read_to_string(&path)?;
        let functions = source.split("fn ").skip(1);
        let is_end = |c: char| !c.is_alphanumeric() && c != '_';
        names.extend(functions.filter_map(|rest| Some(rest.split(is_end).next()?.to_owned())));
    }
    Ok(())
}

fn entry(line: &str) -> Result<Entry<'_>> {
    let mut words = line.split(' ');
    let place = (words.next().unwrap_or_default(), words.next().context("no name")?);
    let rest: Vec<&str> = words.collect();
    let (lines, answer) = match *rest.as_slice() {
        [answer] => (None, answer),
        [lines, answer] => {
            let (from, to) = lines.split_once("..").context("no lines")?;
            (Some(from.parse()?..=to.parse()?), answer)
        }
        _ => bail!("no answer"),
    };
    let is_certified = match answer {
        "in" => Some(true),
        "out" => Some(false),
        "other" => None,
        answer => bail!("`{answer}` is neither in, out nor other"),
    };
    Ok(Entry { place, lines, is_certified })
}

/// The page's section.
pub fn section(text: &mut String, items: &[Item]) -> Result<()> {
    let (certified, others): (Vec<_>, Vec<_>) =
        items.iter().partition(|item| item.is_certified == Some(true));
    write!(
        text,
        "\n## Functions of `core` in a tick\n\nA tick with side and depth executes {} functions of the language's `core`, or what is \
         inlined of them. {} are in the certified subset of `core` for Rust 1.95 that Ferrocene publishes, by \
         [the list](../../tests/prove/src/bound/core_subset.txt) that was read from its report. The others, which whoever \
         certifies a build must qualify or replace:\n\n| function | file of `core` | instructions |\n|---|---|---:|\n",
        items.len(),
        certified.len(),
    )?;
    for Item { file, name, instructions, .. } in others {
        writeln!(text, "| `{name}` | {file} | {instructions} |")?;
    }
    let names = |item: &Item| format!("`{}` ({})", item.name, item.file);
    let names: Vec<String> = certified.into_iter().map(names).collect();
    writeln!(text, "\nIn the subset: {}.", names.join(", "))?;
    Ok(())
}

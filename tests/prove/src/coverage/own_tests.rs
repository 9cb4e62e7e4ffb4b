//! Which lines of the core's sources are its own tests.

// Requirement: E-06

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// The lines, from 1, of items that only tests compile.
pub fn lines(source: &str) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    let mut end: Option<String> = None;
    for (line, number) in source.lines().zip(1..) {
        let indent = &line[..line.len() - line.trim_start().len()];
        if end.is_none() && is_mark(line) {
            end = Some(format!("{indent}}}"));
        }
        if let Some(last) = &end {
            found.insert(number);
            // The item's last line: of a module in another file, that of its name.
            if line == last
                || (line.ends_with(';') && line.strip_suffix(';').is_some_and(is_module))
            {
                end = None;
            }
        }
    }
    found
}

/// Whether a file is a module that only tests compile, by the line in its parent.
pub fn is_test(file: &Path) -> Result<bool> {
    let mut at = PathBuf::from(file);
    while at.file_name().is_some_and(|name| name != "src" && name != "lib.rs") {
        let name = at.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = at.parent().context("a folder")?;
        let parents = [folder.join("mod.rs"), folder.join("lib.rs"), folder.with_extension("rs")];
        if name != "mod" {
            for parent in parents.iter().filter(|parent| parent.exists() && **parent != at) {
                let text = fs::read_to_string(parent)
                    .with_context(|| format!("cannot read {}", parent.display()))?;
                let marks = text.lines().zip(text.lines().skip(1));
                if marks.into_iter().any(|(mark, line)| {
                    is_mark(mark) && line.trim_start() == format!("mod {name};")
                }) {
                    return Ok(true);
                }
            }
        }
        at = folder.to_owned();
    }
    Ok(false)
}

fn is_mark(line: &str) -> bool {
    let line = line.trim_start();
    line == "#[cfg(test)]" || line.starts_with("#[cfg(all(test,")
}

fn is_module(line: &str) -> bool {
    line.trim_start().starts_with("mod ")
}

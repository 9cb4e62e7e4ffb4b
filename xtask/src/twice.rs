//! Checks that the firmware is the same, bit for bit, in whatever folder the checkout is.

// Requirement: P-12

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::firmware::{self, Surface};
use crate::process::{quiet, run};
use crate::toolchain::Cross;
use crate::workspace;

/// Builds the firmware again in a copy of the checkout with a longer path, and compares the bytes that a loader would
/// load. Debug information contains the folder's name, but is not loaded.
///
/// The copy stays below the target folder, so that the next comparison only compiles changes.
///
/// # Errors
/// If a copy, a build or the comparison fails.
pub fn same_bytes(cross: &Cross) -> Result<()> {
    let here = firmware::build(cross, &Surface::default())?;
    let copy = workspace::target().join("twice").join("the checkout in another folder");
    copy_to(&copy)?;
    let mut cargo = cross.cargo_of_copy(&copy, "build");
    firmware::describe(&mut cargo, &Surface::default());
    run(&mut cargo).context("the copy's firmware does not build")?;
    let there = cross.program_of_copy(&copy, "firmware", "board");
    let [here, there] = [here, there].map(|program| loaded(&fs::read(program)?));
    let (here, there) = (here?, there?);
    let is_other = |(a, b): (&u8, &u8)| a != b;
    let first = here.iter().zip(&there).position(is_other);
    ensure!(
        here.len() == there.len() && first.is_none(),
        "{} and {} bytes are loaded, which differ from byte {} on",
        here.len(),
        there.len(),
        first.unwrap_or_else(|| here.len().min(there.len()))
    );
    println!("the same {} bytes are loaded", here.len());
    Ok(())
}

/// Copies the files of the repository. Unchanged files keep their times, which cargo compares.
fn copy_to(copy: &Path) -> Result<()> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
    let listed = quiet(git.current_dir(workspace::root()), Duration::from_secs(20))?;
    for name in listed.split('\0').filter(|name| !name.is_empty()) {
        let (from, to) = (workspace::root().join(name), copy.join(name));
        // A file that is deleted but whose deletion is not committed yet.
        if !from.is_file() {
            continue;
        }
        let bytes = fs::read(&from)?;
        if fs::read(&to).ok().as_ref() != Some(&bytes) {
            fs::create_dir_all(to.parent().context("a folder")?)?;
            fs::write(&to, bytes).with_context(|| format!("cannot write {}", to.display()))?;
        }
    }
    Ok(())
}

/// The segments that a loader would load from a 32-bit little-endian ELF file, each with its address.
///
/// # Errors
/// If it is not such a file.
pub fn loaded(file: &[u8]) -> Result<Vec<u8>> {
    let half = |at: usize| Some(u16::from_le_bytes(file.get(at..)?.first_chunk::<2>().copied()?));
    let word = |at: usize| Some(u32::from_le_bytes(*file.get(at..)?.first_chunk::<4>()?) as usize);
    let segments = || {
        let (table, size, count) = (word(28)?, half(42)?, half(44)?);
        let mut found = Vec::new();
        for number in 0..usize::from(count) {
            let at = table + number * usize::from(size);
            let (kind, offset, place, length) = (word(at)?, word(at + 4)?, at + 8, word(at + 16)?);
            // PT_LOAD, with the addresses of its data in memory and in flash.
            if kind == 1 {
                found.extend(file.get(place..place + 8)?);
                found.extend(file.get(offset..offset + length)?);
            }
        }
        Some(found)
    };
    match segments() {
        Some(found) if file.starts_with(b"\x7fELF\x01\x01") && !found.is_empty() => Ok(found),
        _ => bail!("not a program of 32 bits"),
    }
}

//! Writes the pages of a whole run.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use xtask::process::quiet;
use xtask::workspace;

use super::ensure_clean;
use super::parts::NOT_OF_THE_RUN;
use super::runner::{Done, FILES, PARTS, Part, times};
use crate::harness::figures::Figures;
use crate::harness::record::{self, Raise};
use crate::harness::run::Run;
use crate::harness::{Measured, lanes};

/// Makes pages from those that are in the folder already, and from the parts.
pub struct Writer {
    pub name: &'static str,
    pub write: Box<Write>,
}

/// Writes into a folder.
pub type Write = dyn Fn(&Path) -> Result<()>;

const PAGES: &str = "pages";

/// A test's time, with its build.
const PATIENCE: Duration = Duration::from_mins(20);

/// Kinds of files below docs/evidence. A demo leaves more beside its report.
const KINDS: [&str; 4] = ["md", "json", "svg", "txt"];

/// Writes the pages into the folder `pages`, with a line that says commit, date and machine.
///
/// # Errors
/// If a part of this commit is missing, or a writer fails. There are no pages then.
pub fn write(
    parts: &[Part],
    writers: &[Writer],
    folder: &Path,
    now: &dyn Fn() -> Run,
) -> Result<()> {
    let (pages, new) = (folder.join(PAGES), folder.join("pages.new"));
    for old in [&pages, &new].into_iter().filter(|old| old.exists()) {
        fs::remove_dir_all(old)?;
    }
    let run = now();
    ensure_clean(&run)?;
    let done: Vec<_> = parts.iter().map(|part| part.done(folder, &run)).collect();
    let missing: Vec<_> = parts.iter().zip(&done).filter(|(_, done)| done.is_none()).collect();
    let missing: Vec<_> = missing.iter().map(|(part, _)| part.name.as_str()).collect();
    ensure!(
        missing.is_empty(),
        "no page is written: of commit {} are missing {}",
        run.commit,
        missing.join(", ")
    );
    let done: Vec<Done> = done.into_iter().flatten().collect();
    for part in parts {
        copy(&part.folder(folder).join(FILES), &new)?;
    }
    let line = line(&run);
    mark(&new, &run.commit, &line)?;
    for writer in writers {
        println!("writing {} ...", writer.name);
        (writer.write)(&new).with_context(|| format!("no page is written: {}", writer.name))?;
    }
    fs::write(new.join("run.md"), whole(&line, parts, &done))?;
    ensure!(now().is_of_the_same(&run), "no page is written: the checkout changed");
    fs::rename(&new, &pages)?;
    println!("{}", pages.display());
    Ok(())
}

/// The line that says commit, date and machine.
fn line(run: &Run) -> String {
    let Run { date, commit, compiler, machine, emulator, .. } = run;
    format!(
        "Measured by one run of `cargo xtask evidence` at commit `{commit}`, until {date}; {machine}; {compiler}; {emulator}."
    )
}

/// Adds the line to measured pages that do not name the commit. Those that a record is rendered to name it.
fn mark(folder: &Path, commit: &str, line: &str) -> Result<()> {
    for file in fs::read_dir(folder)? {
        let path = file?.path();
        if path.extension().is_some_and(|kind| kind == "md") {
            let text = fs::read_to_string(&path)?;
            if !text.contains(commit) {
                fs::write(&path, format!("{}\n\n{line}\n", text.trim_end()))?;
            }
        }
    }
    Ok(())
}

/// The page of the run.
fn whole(line: &str, parts: &[Part], done: &[Done]) -> String {
    let minutes = seconds(done.iter().map(|done| [done.start, done.start + done.seconds])) / 60.0;
    let mut text = format!(
        "# The run\n\n{line} Its parts took {minutes:.0} min, two beside each other but where one measures time.\n\n| part | s |\n|---|---:|\n"
    );
    for (part, Done { seconds, skipped, .. }) in parts.iter().zip(done) {
        let skipped = skipped.as_ref().map_or_else(String::new, |why| format!(" ({why})"));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {}{skipped} | {seconds:.0} |", part.name);
    }
    text + "\nNot of the run: " + NOT_OF_THE_RUN + "\n"
}

/// The seconds that are in at least one of these spans.
pub fn seconds(spans: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut spans: Vec<_> = spans.collect();
    spans.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let (mut sum, mut until) = (0.0, 0.0_f64);
    for [start, end] in spans {
        sum += (end - start.max(until)).max(0.0);
        until = until.max(end);
    }
    sum
}

/// The parts, for the user.
pub fn list(parts: &[Part], folder: &Path) -> String {
    let (mut text, times) = (String::new(), times(folder));
    for Part { name, place, .. } in parts {
        let seconds = times.get(name).map_or_else(|| "?".to_owned(), f64::to_string);
        let _ = writeln!(text, "{seconds:>5} s  {place:?}  {name}");
    }
    text + "Not of the run: " + NOT_OF_THE_RUN + "\n"
}

/// Copies the pages and records in a folder, and in those below it.
fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for file in fs::read_dir(from)? {
        let file = file?;
        let (path, to) = (file.path(), to.join(file.file_name()));
        if path.is_dir() {
            copy(&path, &to)?;
        } else if path.extension().is_some_and(|kind| KINDS.iter().any(|one| kind == *one)) {
            fs::copy(path, to)?;
        }
    }
    Ok(())
}

/// Combines the figures of all checks in a run's folder, and writes the records and guarantees.md.
pub fn gather(folder: &Path, run: Run, raise: Raise<'_>) -> Result<()> {
    let mut measured = Measured { figures: Figures::default(), skipped: Vec::new(), run };
    for part in fs::read_dir(folder.join(PARTS))? {
        if let Some(figures) = lanes::figures(&part?.path())? {
            measured.figures.append(figures);
        }
    }
    record::write_whole(&measured, raise)
}

/// Copies the pages to docs/evidence, and writes the figures in other documents anew.
pub fn release(folder: &Path) -> Result<()> {
    copy(&folder.join(PAGES), &workspace::root().join("docs/evidence"))?;
    for [test, name] in [["pages", "readme"], ["own", "figures::"]] {
        let mut cargo = Command::new("cargo");
        cargo.args(["test", "--release", "--quiet", "--test", test, name]);
        cargo.env("DIBS_WRITE", "1").current_dir(workspace::root());
        let said = quiet(&mut cargo, PATIENCE)?;
        ensure!(!said.contains("running 0 tests"), "no test of `{test}` has `{name}` in its name");
    }
    println!("docs/evidence is of this run: look at `git diff`, and commit it");
    Ok(())
}

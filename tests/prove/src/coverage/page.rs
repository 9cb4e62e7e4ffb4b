//! docs/evidence/coverage.md.

// Requirement: E-06

use std::fmt::Write as _;

use super::reasons::Reason;
use super::record::{Open, Record, Sums};

fn share([executed, all]: [usize; 2]) -> String {
    let percent = 100.0 * executed as f64 / all.max(1) as f64;
    // Rounded down: 100.00 is all.
    format!("{:.2} %", (percent * 100.0).floor() / 100.0)
}

/// The figures in two lines.
pub fn summary(record: &Record, reasons: &[Reason]) -> String {
    let Sums { statements, branches, .. } = record.sums();
    let without = record.open.iter().filter(|open| !reasons.iter().any(|why| why.is_of(open)));
    format!(
        "statements {} ({} of {}), branches {} ({} of {})\n{} places not executed, {} of them without a reason",
        share(statements),
        statements[0],
        statements[1],
        share(branches),
        branches[0],
        branches[1],
        record.open.len(),
        without.count(),
    )
}

/// The page.
pub fn page(record: &Record, reasons: &[Reason]) -> String {
    let all = record.sums();
    let row = |name: &str, [executed, all]: [usize; 2], goal: &str| {
        format!("| {name} | {executed} | {all} | {} | {goal} |\n", share([executed, all]))
    };
    let mut text = format!(
        "# Coverage of the core\n\n\
         Written by `cargo xtask coverage`: do not edit. Of commit {}, {}, {}. The reasons are those of \
         [.cargo/coverage.json](../../.cargo/coverage.json); a test compares them with \
         [the record](coverage.json).\n\n\
         Executed by the core's own tests and by the programs `bus`, `surface`, `tree` and `query` of `tests/`, on this \
         computer. A generic function counts as its instances together. A *statement* is a line with code, and counts as \
         its most executed part. A *branch* is an outcome of a condition: of `if`, `if let`, `let else`, `while`, `&&`, `||` and of a guard, not of \
         `match` and `?`. A *region* is a part of a line between such places, the end by `?` among them. \
         The core's tests themselves do not count. Not compiled, so not counted: `cfg` of other processors, of `defmt`, \
         `portable-atomic` and `loom`; code that the compiler evaluates does not count as executed.\n\n\
         | of {} files | executed | all | share | goal |\n|---|---:|---:|---:|---:|\n{}{}{}\n",
        record.run.commit,
        record.run.date,
        record.run.compiler,
        record.files.len(),
        row("statements", all.statements, "100 %"),
        row("branches", all.branches, "95 %"),
        row("regions", all.regions, "–"),
    );
    let is_known = |open: &&Open| reasons.iter().any(|reason| reason.is_of(open));
    let without: Vec<&Open> = record.open.iter().filter(|open| !is_known(open)).collect();
    let _ = write!(
        text,
        "Of {} places that are not executed {} have a reason.\n\n## With a reason\n",
        record.open.len(),
        record.open.len() - without.len()
    );
    for reason in reasons {
        // A place has the first of its reasons.
        let is_own = |open: &&Open| {
            let first = reasons.iter().find(|reason| reason.is_of(open));
            first.is_some_and(|first| std::ptr::eq(first, reason))
        };
        let own: Vec<&Open> = record.open.iter().filter(is_own).collect();
        let _ = write!(text, "\n{} ({})\n\n", reason.because, own.len());
        rows(&mut text, &own);
    }
    text += "\n## Without a reason\n\n";
    if without.is_empty() {
        text += "None.\n";
    } else {
        text += "No test executes these, and nobody has said why: each may be dead, or a test may be missing.\n\n";
        rows(&mut text, &without);
    }
    text += "\n## By file\n\nOnly files with a place that is not executed.\n\n| file | statements | branches | regions |\n|---|---:|---:|---:|\n";
    for Sums { file, statements, branches, regions } in &record.files {
        if record.open.iter().any(|open| open.file == *file) {
            let _ = writeln!(
                text,
                "| {file} | {} | {} | {} |",
                share(*statements),
                share(*branches),
                share(*regions)
            );
        }
    }
    text
}

/// A row for each place, those of consecutive lines in one.
fn rows(text: &mut String, open: &[&Open]) {
    *text += "| file | line | not executed |\n|---|---:|---|\n";
    let mut rest = open;
    while let Some((first, after)) = rest.split_first() {
        let is_next = |(number, open): &(u32, &&Open)| {
            open.file == first.file && open.number == *number && open.condition.is_none()
        };
        let more = match &first.condition {
            Some(_) => 0,
            None => (first.number + 1..).zip(after).take_while(is_next).count(),
        };
        let line = first.line.replace('|', "\\|").replace('`', "'");
        let what = match &first.condition {
            Some((condition, outcome)) => {
                let condition = condition.replace('|', "\\|").replace('`', "'");
                format!("`{condition}` {outcome}")
            }
            None if more > 0 => format!("`{line}` and {more} more"),
            None => format!("`{line}`"),
        };
        let _ = writeln!(text, "| {} | {} | {what} |", first.file, first.number);
        rest = &after[more..];
    }
}

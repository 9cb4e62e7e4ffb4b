//! docs/evidence/guarantees.md, from the records and the texts in `texts/`.

// Requirement: E-02

use std::fmt::Write;

use anyhow::Result;
use serde_json::Value;

use super::faults;
use super::record::{Record, Search, promises};
use super::run::Run;

/// The document.
pub fn render(records: &[Record]) -> Result<String> {
    let mut out = String::from(include_str!("texts/head.md"));
    let newest = newest(records);
    out.push('\n');
    provenance(&mut out, records, newest)?;
    out.push_str("\n| promise | figure | bound | check | IEC 62304 §5.5.4 | limits |\n");
    out.push_str("|---|---:|---|---|---|---|\n");
    for record in records.iter().filter(|record| !record.promise.is_empty()) {
        writeln!(
            out,
            "| {} | {} {}{} | {} | {} | {} | {}{} |",
            record.promise,
            shown(&record.figure),
            with_figures(&record.unit, records),
            record.of(newest),
            record.bound,
            record.check,
            record.criterion,
            with_figures(&record.limits, records),
            larger(record)
        )?;
    }
    out.push_str("\n## Instructions of the hot functions\n\n");
    out.push_str(include_str!("texts/instructions.md"));
    out.push_str("\n| where | function | instructions |\n|---|---|---:|\n");
    for record in records.iter().filter(|record| record.promise.is_empty() && record.is_shown()) {
        let (place, name) = match record.id.split_once('.') {
            Some(("host", name)) => ("host", name),
            Some(("m7", name)) => ("Cortex-M7", name),
            _ => ("Cortex-M7", record.id.as_str()),
        };
        let (figure, of) = (shown(&record.figure), record.of(newest));
        let raised = Some(&record.raised).filter(|raised| !raised.is_empty());
        let raised = raised.map_or_else(String::new, |raised| format!("; {raised}"));
        writeln!(out, "| {place} | `{name}` | {figure}{of}{raised} |")?;
    }
    out.push('\n');
    out.push_str(&faults::render()?);
    out.push_str(include_str!("texts/tail.md"));
    Ok(out)
}

/// A sentence about the larger search that a record keeps.
fn larger(record: &Record) -> String {
    let Some(Search { figure, unit, run }) = &record.larger else { return String::new() };
    format!(" In a larger search {} {unit} (`{}`, {}).", shown(figure), run.commit, run.day())
}

/// The last run that measured anything.
fn newest(records: &[Record]) -> Option<&Run> {
    records.iter().map(|record| &record.run).max()
}

/// States the commit of all rows, or of each row if they differ.
fn provenance(out: &mut String, records: &[Record], newest: Option<&Run>) -> Result<()> {
    let Some(newest) = newest else { return Ok(()) };
    let missing = promises().filter(|(_, p)| records.iter().all(|r| r.id != p.id)).count();
    let mut runs: Vec<(&Run, usize)> = Vec::new();
    for record in records {
        match runs.iter_mut().find(|(run, _)| run.is_of_the_same(&record.run)) {
            Some((_, count)) => *count += 1,
            None => runs.push((&record.run, 1)),
        }
    }
    let Run { date, commit, compiler, machine, emulator, size } = newest;
    if runs.len() == 1 && missing == 0 && newest.is_whole() {
        writeln!(
            out,
            "**All of it was measured at commit `{commit}`**, until {date}, size `{size}`: {} figures; {compiler}; {machine}; \
             {emulator}.",
            records.len()
        )?;
        return Ok(());
    }
    writeln!(
        out,
        "**NOT OF ONE RUN.** The last is of commit `{commit}`, {date}, size `{size}`; a figure of another \
         says of which in brackets.{}\n",
        if missing > 0 {
            format!(" {missing} figures were never recorded.")
        } else {
            String::new()
        }
    )?;
    writeln!(out, "| commit | date | size | figures | compiler | machine | emulator |")?;
    writeln!(out, "|---|---|---|---:|---|---|---|")?;
    for (Run { date, commit, compiler, machine, emulator, size }, count) in runs {
        writeln!(
            out,
            "| `{commit}` | {date} | {size} | {count} | {compiler} | {machine} | {emulator} |"
        )?;
    }
    Ok(())
}

impl Record {
    /// Whether it has a separate line.
    pub fn is_shown(&self) -> bool {
        let is_counted = ["host.", "m7.", "modes."].iter().any(|part| self.id.starts_with(part));
        !self.promise.is_empty() || is_counted
    }

    /// States its run, if that is not the newest.
    fn of(&self, newest: Option<&Run>) -> String {
        match newest {
            Some(newest) if !newest.is_of_the_same(&self.run) => {
                format!(" (`{}`, {})", self.run.commit, self.run.day())
            }
            _ => String::new(),
        }
    }
}

/// Replaces `{id}` in a text by the figure of that record.
pub fn with_figures(text: &str, records: &[Record]) -> String {
    let mut text = text.to_owned();
    for record in records {
        let place = format!("{{{}}}", record.id);
        if text.contains(&place) {
            text = text.replace(&place, &shown(&record.figure));
        }
    }
    text
}

/// A number with separated thousands, or a text.
fn shown(figure: &Value) -> String {
    let Some(number) = figure.as_f64() else {
        return figure.as_str().map_or_else(|| figure.to_string(), |text| format!("`{text}`"));
    };
    if number.fract() != 0.0 {
        return if number < 1.0 { format!("{number:.3}") } else { format!("{number:.1}") };
    }
    grouped(number as u64)
}

/// A number with separated thousands.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

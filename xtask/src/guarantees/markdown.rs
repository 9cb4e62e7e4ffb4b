//! docs/guarantees.md, from the records and the texts in `texts/`.

use std::fmt::Write;

use anyhow::Result;
use serde_json::Value;

use super::faults;
use super::record::Record;

/// The document.
pub fn render(records: &[Record]) -> Result<String> {
    let mut out = String::from(include_str!("texts/head.md"));
    out.push_str("\n| promise | figure | bound | check | IEC 62304 §5.5.4 | limits |\n");
    out.push_str("|---|---:|---|---|---|---|\n");
    for record in records.iter().filter(|record| !record.promise.is_empty()) {
        writeln!(
            out,
            "| {} | {} {} | {} | {} | {} | {} |",
            record.promise,
            shown(&record.figure),
            with_figures(&record.unit, records),
            record.bound,
            record.check,
            record.criterion,
            with_figures(&record.limits, records)
        )?;
    }
    out.push_str("\n## Instructions of the hot functions\n\n");
    out.push_str(include_str!("texts/instructions.md"));
    out.push_str("\n| where | function | instructions |\n|---|---|---:|\n");
    for record in records.iter().filter(|record| record.promise.is_empty()) {
        if let Some(name) = record.id.strip_prefix("host.") {
            writeln!(out, "| host | `{name}` | {} |", shown(&record.figure))?;
        } else if let Some(name) = record.id.strip_prefix("m7.") {
            writeln!(out, "| Cortex-M7 | `{name}` | {} |", shown(&record.figure))?;
        } else if record.id.starts_with("modes.") {
            writeln!(out, "| Cortex-M7 | `{}` | {} |", record.id, shown(&record.figure))?;
        }
    }
    out.push('\n');
    out.push_str(&faults::render()?);
    out.push_str(include_str!("texts/tail.md"));
    Ok(out)
}

/// `{id}` in a text stands for the figure of that record.
fn with_figures(text: &str, records: &[Record]) -> String {
    let mut text = text.to_owned();
    for record in records {
        let place = format!("{{{}}}", record.id);
        if text.contains(&place) {
            text = text.replace(&place, &shown(&record.figure));
        }
    }
    text
}

/// A number with its thousands apart, or a text.
fn shown(figure: &Value) -> String {
    let Some(number) = figure.as_f64() else {
        return figure.as_str().map_or_else(|| figure.to_string(), |text| format!("`{text}`"));
    };
    if number.fract() != 0.0 {
        return if number < 1.0 { format!("{number:.3}") } else { format!("{number:.1}") };
    }
    grouped(number as u64)
}

/// A number with its thousands apart.
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

//! Parses a tool: `0,0,150,5`, `sphere:0,0,150,5` or `{"sphere": [0, 0, 150, 5]}`, or a chain of tools.

use super::{REMEDY, ToolSpec, check_chain, of_numbers};
use anyhow::{Result, anyhow, bail};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum JsonTool {
    Sphere([f64; 4]),
    Capsule([f64; 7]),
}

/// Parses a text of exactly one tool.
pub fn one(text: &str) -> Result<ToolSpec> {
    match *chain(text)? {
        [tool] => Ok(tool),
        ref tools => bail!(
            "{} tools in place of one: give --tool once for each, and --path one tool a line",
            tools.len()
        ),
    }
}

/// Parses a text of one or several tools.
pub fn chain(text: &str) -> Result<Vec<ToolSpec>> {
    let text = text.trim();
    let tools: Vec<ToolSpec> = match text.as_bytes() {
        [b'[', ..] => {
            json::<Vec<JsonTool>>(text)?.iter().map(JsonTool::tool).collect::<Result<_>>()
        }
        [b'{', ..] => Ok(vec![json::<JsonTool>(text)?.tool()?]),
        _ => tools(text).iter().map(|tool| word(tool)).collect(),
    }?;
    if tools.is_empty() {
        bail!("a chain of no tools; {REMEDY}");
    }
    check_chain(&tools)?;
    Ok(tools)
}

/// Whether a line has column names instead of numbers.
pub fn is_header(line: &str) -> bool {
    !line.starts_with(['[', '{'])
        && !line.contains(':')
        && matches!(line.split(',').count(), 4 | 7)
        && line.split(',').all(|cell| cell.trim().parse::<f32>().is_err())
}

/// The tools of a text that is not JSON. Each tool after the first begins at a word with a colon, because spaces may
/// follow commas.
fn tools(text: &str) -> Vec<String> {
    let mut tools: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match tools.last_mut() {
            Some(tool) if !word.contains(':') => *tool += &format!(" {word}"),
            _ => tools.push(word.to_owned()),
        }
    }
    tools
}

/// Parses numbers, with or without a shape before them.
fn word(text: &str) -> Result<ToolSpec> {
    let (shape, numbers) =
        text.split_once(':').map_or((None, text), |(shape, numbers)| (Some(shape), numbers));
    let number = |(number, cell): (usize, &str)| {
        cell.trim()
            .parse()
            .map_err(|_| anyhow!("value {number}, '{}', is not a number; {REMEDY}", cell.trim()))
    };
    let numbers: Vec<f64> = (1..).zip(numbers.split(',')).map(number).collect::<Result<_>>()?;
    match (shape, numbers.len()) {
        (None, _) | (Some("sphere"), 4) | (Some("capsule"), 7) => of_numbers(&numbers),
        (Some(shape), count) => bail!(
            "'{shape}' of {count} numbers is no tool: expected sphere:X,Y,Z,R or capsule:X1,Y1,Z1,X2,Y2,Z2,R"
        ),
    }
}

fn json<'a, T: Deserialize<'a>>(line: &'a str) -> Result<T> {
    serde_json::from_str(line).map_err(|error| {
        let what = error.to_string();
        // The error's line is always the first.
        let what = what.rsplit_once(" at line ").map_or(&*what, |(what, _)| what);
        anyhow!(
            "column {}: {what}; give {{\"sphere\": [X, Y, Z, R]}}, {{\"capsule\": [X1, Y1, Z1, X2, Y2, Z2, R]}}, \
             or a chain of them in [ ]",
            error.column()
        )
    })
}

impl JsonTool {
    fn tool(&self) -> Result<ToolSpec> {
        match self {
            Self::Sphere(numbers) => of_numbers(numbers),
            Self::Capsule(numbers) => of_numbers(numbers),
        }
    }
}

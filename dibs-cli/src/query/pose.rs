//! A line of a file of poses: a tool, or a chain of them.

use super::tool::{ToolSpec, parse_tool, tool};
use anyhow::{Result, anyhow, bail};
use serde::Deserialize;

const REMEDY: &str = "give X,Y,Z,R for a sphere or X1,Y1,Z1,X2,Y2,Z2,R for a capsule";

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum JsonTool {
    Sphere([f64; 4]),
    Capsule([f64; 7]),
}

/// The tools of a line that is not empty.
pub fn parse(line: &str) -> Result<Vec<ToolSpec>> {
    let tools = match line.as_bytes() {
        [b'[', ..] => {
            json::<Vec<JsonTool>>(line)?.iter().map(JsonTool::tool).collect::<Result<_>>()
        }
        [b'{', ..] => Ok(vec![json::<JsonTool>(line)?.tool()?]),
        _ if line.contains(':') => line.split_whitespace().map(parse_tool).collect(),
        _ => Ok(vec![csv(line)?]),
    }?;
    if tools.is_empty() {
        bail!("a chain of no tools; {REMEDY}");
    }
    super::check_chain(&tools)?;
    Ok(tools)
}

/// Whether a line has names of columns instead of numbers.
pub fn is_header(line: &str) -> bool {
    !line.starts_with(['[', '{'])
        && !line.contains(':')
        && matches!(line.split(',').count(), 4 | 7)
        && line.split(',').all(|cell| cell.trim().parse::<f32>().is_err())
}

fn csv(line: &str) -> Result<ToolSpec> {
    let number = |(number, cell): (usize, &str)| {
        cell.trim()
            .parse()
            .map_err(|_| anyhow!("value {number}, '{}', is not a number; {REMEDY}", cell.trim()))
    };
    let numbers: Vec<f64> = (1..).zip(line.split(',')).map(number).collect::<Result<_>>()?;
    tool(&numbers)
}

fn json<'a, T: Deserialize<'a>>(line: &'a str) -> Result<T> {
    serde_json::from_str(line).map_err(|error| {
        let what = error.to_string();
        // Its line is always the first.
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
            Self::Sphere(numbers) => tool(numbers),
            Self::Capsule(numbers) => tool(numbers),
        }
    }
}

//! Files of tools, line by line.

use super::{ToolSpec, grammar, one};
use anyhow::{Result, anyhow, bail};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Bytes per read: some thousand tools.
const BUFFER: usize = 1 << 18;

/// The longest line, in bytes.
const LONGEST: u64 = 1 << 16;

/// The lines of a file, or of standard input, whose name is `-`.
pub struct Lines {
    input: BufReader<Box<dyn Read>>,
    pub name: String,
    /// Number of the last line that was read, from 1.
    pub number: usize,
}

impl Lines {
    pub fn open(path: &Path) -> Result<Self> {
        let (name, input): (_, Box<dyn Read>) = if path == Path::new("-") {
            ("standard input".to_owned(), Box::new(io::stdin()))
        } else {
            let name = path.display().to_string();
            let file = File::open(path)
                .map_err(|error| anyhow!("{name}: cannot be read ({error}); check the path"))?;
            (name, Box::new(file))
        };
        Ok(Self { input: BufReader::with_capacity(BUFFER, input), name, number: 0 })
    }

    /// The next line; `Some(None)` if it has no tool, `None` at the end.
    pub fn next(&mut self) -> Result<Option<Option<String>>> {
        self.number += 1;
        let name = || format!("{}, line {}", self.name, self.number);
        let mut line = Vec::new();
        let read = (&mut self.input).take(LONGEST).read_until(b'\n', &mut line);
        let read = read.map_err(|error| anyhow!("{}: cannot be read ({error})", name()))?;
        if read == 0 {
            return Ok(None);
        }
        if read as u64 == LONGEST {
            bail!("{}: longer than {LONGEST} bytes; give one pose a line", name());
        }
        let line = String::from_utf8(line)
            .map_err(|_| anyhow!("{}: is not text; give CSV or JSON lines in UTF-8", name()))?;
        // Excel begins a file with a byte order mark.
        let line = line.trim_start_matches('\u{feff}').trim();
        let has_none = line.is_empty() || self.number == 1 && grammar::is_header(line);
        Ok(Some((!has_none).then(|| line.to_owned())))
    }

    /// Whether another line is available already.
    pub fn is_waiting(&self) -> bool {
        self.input.buffer().contains(&b'\n')
    }
}

/// Reads the tool at each tick, a line each, converted by `each`.
pub fn path<T>(path: &Path, each: impl Fn(ToolSpec) -> Result<T>) -> Result<Vec<T>> {
    let mut lines = Lines::open(path)?;
    let mut tools = Vec::new();
    while let Some(line) = lines.next()? {
        let Some(line) = line else { continue };
        let tool = one(&line).and_then(&each);
        tools
            .push(tool.map_err(|error| anyhow!("{}, line {}: {error}", lines.name, lines.number))?);
    }
    if tools.is_empty() {
        bail!("{}: no line, and so no tick; give a tool for each tick", lines.name);
    }
    Ok(tools)
}

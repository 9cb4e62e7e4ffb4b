//! Many poses, answered as fast as they come.

use super::pose;
use super::scene::{self, Room, Surface};
use crate::mesh_file::spinner;
use crate::output;
use anyhow::{Result, anyhow, bail};
use dibs_build::write_atomically;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// Bytes that are read at once: some thousand poses.
const BUFFER: usize = 1 << 18;

/// The longest line, in bytes.
const LONGEST: u64 = 1 << 16;

/// Answers every line of `poses`.
pub fn run(
    surfaces: &[Surface<'_>],
    margin: Option<f32>,
    poses: &Path,
    output: &Path,
) -> Result<()> {
    let (name, input): (_, Box<dyn Read>) = if poses == Path::new("-") {
        ("standard input".to_owned(), Box::new(io::stdin()))
    } else {
        let name = poses.display().to_string();
        let file = File::open(poses)
            .map_err(|error| anyhow!("{name}: cannot be read ({error}); check the path"))?;
        (name, Box::new(file))
    };
    let mut lines = Lines { input: BufReader::with_capacity(BUFFER, input), name, number: 0 };
    if output == Path::new("-") {
        return lines.answer(surfaces, margin, &mut |bytes| Ok(output::write(bytes)));
    }
    let mut failure = Ok(());
    let spinner = spinner("answering");
    let written = write_atomically(output, |file| {
        failure = lines.answer(surfaces, margin, &mut |bytes| {
            file.write_all(bytes)?;
            Ok(true)
        });
        // Whatever ends here, the file keeps its old content.
        if failure.is_err() { Err(io::Error::other("incomplete")) } else { Ok(()) }
    });
    spinner.finish_and_clear();
    failure.and(written.map_err(Into::into))
}

struct Lines {
    input: BufReader<Box<dyn Read>>,
    name: String,
    /// Of the last line that was read, from 1.
    number: usize,
}

impl Lines {
    /// Answers the lines in their order, up to the first wrong one, as long as `write` wants more.
    fn answer(
        &mut self,
        surfaces: &[Surface<'_>],
        margin: Option<f32>,
        write: &mut dyn FnMut(&[u8]) -> Result<bool>,
    ) -> Result<()> {
        loop {
            let (batch, end) = self.batch();
            let answers: Vec<Result<Vec<u8>>> = batch
                .par_iter()
                .map_init(Room::default, |room, (number, line)| {
                    answer(surfaces, margin, room, *number, line)
                        .map_err(|error| anyhow!("{}, line {number}: {error}", self.name))
                })
                .collect();
            let (mut bytes, mut failure) = (Vec::new(), end);
            for answer in answers {
                match answer {
                    Ok(line) => bytes.extend(line),
                    Err(error) => {
                        failure = Err(error);
                        break;
                    }
                }
            }
            if !write(&bytes)? {
                return Ok(());
            }
            if !failure? {
                return Ok(());
            }
        }
    }

    /// The lines that are there, at least one unless the input has ended, and whether more may come: whoever
    /// waits for an answer before the next line gets it.
    fn batch(&mut self) -> (Vec<(usize, String)>, Result<bool>) {
        let mut batch = Vec::new();
        loop {
            match self.line() {
                Ok(None) => return (batch, Ok(false)),
                Ok(Some(line)) => batch.extend(line.map(|line| (self.number, line))),
                Err(error) => return (batch, Err(error)),
            }
            if !self.input.buffer().contains(&b'\n') {
                return (batch, Ok(true));
            }
        }
    }

    /// The next line, `Some(None)` where it asks nothing, `None` at the end.
    fn line(&mut self) -> Result<Option<Option<String>>> {
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
            .map_err(|_| anyhow!("{}: is no text; give CSV or JSON lines in UTF-8", name()))?;
        // Excel begins a file with this mark.
        let line = line.trim_start_matches('\u{feff}').trim();
        let asks_nothing = line.is_empty() || self.number == 1 && pose::is_header(line);
        Ok(Some((!asks_nothing).then(|| line.to_owned())))
    }
}

fn answer(
    surfaces: &[Surface<'_>],
    margin: Option<f32>,
    room: &mut Room,
    number: usize,
    line: &str,
) -> Result<Vec<u8>> {
    let answer = scene::ask(surfaces, &pose::parse(line)?, margin, room)?;
    let mut bytes = serde_json::to_vec(&answer.record(Some(number)))?;
    bytes.push(b'\n');
    Ok(bytes)
}

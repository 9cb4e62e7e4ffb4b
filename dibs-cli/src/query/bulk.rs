//! Answers many poses, as they are read.

use super::scene::{self, Room, Surface};
use crate::mesh_file::spinner;
use crate::output;
use crate::tool::{self, Lines};
use anyhow::{Result, anyhow};
use dibs_build::write_atomically;
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// Answers every line of `poses`.
pub fn run(
    surfaces: &[Surface<'_>],
    margin: Option<f32>,
    poses: &Path,
    output: &Path,
) -> Result<()> {
    let mut lines = Lines::open(poses)?;
    if output == Path::new("-") {
        return answer_all(&mut lines, surfaces, margin, &mut |bytes| Ok(output::write(bytes)));
    }
    let mut failure = Ok(());
    let spinner = spinner("answering");
    let written = write_atomically(output, |file| {
        failure = answer_all(&mut lines, surfaces, margin, &mut |bytes| {
            file.write_all(bytes)?;
            Ok(true)
        });
        // On any failure the output file keeps its old content.
        if failure.is_err() { Err(io::Error::other("incomplete")) } else { Ok(()) }
    });
    spinner.finish_and_clear();
    failure.and(written.map_err(Into::into))
}

/// Answers the lines in their order, up to the first wrong line, as long as `write` returns true.
fn answer_all(
    lines: &mut Lines,
    surfaces: &[Surface<'_>],
    margin: Option<f32>,
    write: &mut dyn FnMut(&[u8]) -> Result<bool>,
) -> Result<()> {
    loop {
        let (batch, end) = batch(lines);
        let name = &lines.name;
        let answers: Vec<Result<Vec<u8>>> = batch
            .par_iter()
            .map_init(Room::default, |room, (number, line)| {
                answer(surfaces, margin, room, *number, line)
                    .map_err(|error| anyhow!("{name}, line {number}: {error}"))
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

/// The lines that are available, at least one unless the input has ended, and whether more may come. So a writer that
/// waits for an answer before its next line gets it.
fn batch(lines: &mut Lines) -> (Vec<(usize, String)>, Result<bool>) {
    let mut batch = Vec::new();
    loop {
        match lines.next() {
            Ok(None) => return (batch, Ok(false)),
            Ok(Some(line)) => batch.extend(line.map(|line| (lines.number, line))),
            Err(error) => return (batch, Err(error)),
        }
        if !lines.is_waiting() {
            return (batch, Ok(true));
        }
    }
}

fn answer(
    surfaces: &[Surface<'_>],
    margin: Option<f32>,
    room: &mut Room,
    number: usize,
    line: &str,
) -> Result<Vec<u8>> {
    let answer = scene::ask(surfaces, &tool::chain(line)?, margin, room)?;
    let mut bytes = serde_json::to_vec(&answer.record(Some(number)))?;
    bytes.push(b'\n');
    Ok(bytes)
}

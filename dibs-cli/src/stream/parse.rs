//! Frames from a stream of bytes: raw numbers, or JSON lines.

use super::coordinates::SourceCoordinates;
use super::live::ParsedFrame;
use super::part::Part;
use anyhow::{Result, anyhow, bail};
use dibs_build::glam::Vec3;
use serde::Deserialize;
use std::io::{BufRead, BufReader, Read};
use std::time::{Duration, Instant};

/// Bytes of a raw position.
pub const RAW: usize = 12;

/// Largest size of a position in JSON: three numbers with all their digits, and white space.
const MOST_JSON: usize = 256;

/// The format of frames.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Little-endian f32 numbers: x, y and z of each position
    Raw,
    /// A frame a line
    Json,
}

/// Reads one frame after another.
pub struct Parser<R> {
    /// The stream's name in errors.
    name: String,
    input: BufReader<R>,
    format: Format,
    place: SourceCoordinates,
    /// Whether a stated rate gives the frames their times, so that their arrival says nothing of their age.
    is_paced: bool,
    /// The last frame.
    last: Option<Part<Vec<Vec3>>>,
    /// Number of the next frame, from 0.
    number: usize,
}

/// Positions in the source's unit, and their stated age.
type RawFrame = (Vec<[f64; 3]>, Option<Duration>);

/// JavaScript writes a coordinate that is not finite as `null`.
type Point = [Option<f64>; 3];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Object {
    positions: Vec<Point>,
    age_ms: Option<f64>,
}

impl<R: Read> Parser<R> {
    pub fn new(
        name: String,
        format: Format,
        place: SourceCoordinates,
        is_paced: bool,
        input: R,
    ) -> Self {
        let input = BufReader::with_capacity(1 << 18, input);
        Self { name, input, format, place, is_paced, last: None, number: 0 }
    }

    /// The next frame; `None` at the end.
    pub fn next(&mut self) -> Result<Option<ParsedFrame>> {
        let (number, name) = (self.number, self.name.clone());
        let read = match self.format {
            Format::Raw => self.raw(),
            Format::Json => self.json(),
        };
        let in_frame = |error| anyhow!("{name}, frame {number}: {error}");
        let Some((positions, age)) = read.map_err(in_frame)? else {
            if number == 0 {
                bail!("{name}: no frame came; does the program that makes them run?");
            }
            return Ok(None);
        };
        let came = Instant::now();
        self.number += 1;
        let positions = self.place.frame(positions, number);
        let positions = positions.map_err(|error| anyhow!("{name}: {error}"))?;
        let age = if age.is_some() || self.is_paced {
            self.last = None;
            age.unwrap_or_default()
        } else {
            let part = Part { value: positions.clone(), time: 0.0, came, delay: Duration::ZERO };
            Part::replace(&mut self.last, part).age(came)
        };
        Ok(Some(ParsedFrame { positions, pose: None, came, age }))
    }

    fn raw(&mut self) -> Result<Option<RawFrame>> {
        let count = self.place.order.positions();
        let size = RAW * count;
        let mut bytes = Vec::with_capacity(size);
        (&mut self.input).take(size as u64).read_to_end(&mut bytes)?;
        // Coordinates do not contain so long a run of letters and digits.
        if self.number == 0 && !bytes.is_empty() && bytes.iter().all(is_text) {
            bail!("begins with text: give --format json for JSON lines");
        }
        if !bytes.is_empty() && bytes.len() < size {
            bail!(
                "ends after {} of its {size} bytes, in position {} (counted from 0) of {count}: give frames of {count} \
                 positions, each x, y and z as little-endian f32, and end after a whole one",
                bytes.len(),
                bytes.len() / RAW
            );
        }
        let (words, _) = bytes.as_chunks::<4>();
        let (points, _) = words.as_chunks::<3>();
        let points: Vec<[f64; 3]> =
            points.iter().map(|point| point.map(|x| f32::from_le_bytes(x).into())).collect();
        Ok((!points.is_empty()).then_some((points, None)))
    }

    fn json(&mut self) -> Result<Option<RawFrame>> {
        let most = (MOST_JSON * (self.place.order.positions() + 16)) as u64;
        let mut line = Vec::new();
        while line.trim_ascii().is_empty() {
            line.clear();
            let read = (&mut self.input).take(most).read_until(b'\n', &mut line)?;
            if read == 0 {
                return Ok(None);
            }
            if read as u64 == most {
                bail!("a line longer than {most} bytes: give one frame a line");
            }
        }
        let line = line.trim_ascii();
        let (points, age) = match line {
            [b'[', ..] => (json::<Vec<Point>>(line)?, None),
            _ => {
                let Object { positions, age_ms } = json(line)?;
                (positions, age_ms)
            }
        };
        let age = age.map(|ms| {
            Duration::try_from_secs_f64(ms / 1000.0)
                .map_err(|_| anyhow!("age_ms is {ms}: give milliseconds of at least 0"))
        });
        let points = points.iter().map(|point| point.map(|x| x.unwrap_or(f64::NAN))).collect();
        Ok(Some((points, age.transpose()?)))
    }
}

fn json<'a, T: Deserialize<'a>>(line: &'a [u8]) -> Result<T> {
    serde_json::from_slice(line).map_err(|error| {
        let what = error.to_string();
        // The error's line is always the first.
        let what = what.rsplit_once(" at line ").map_or(&*what, |(what, _)| what);
        // The list opens with one bracket, and so does each position.
        let before = line.get(..error.column()).unwrap_or(line);
        let opened = before.iter().filter(|&&byte| byte == b'[').count();
        let at = match opened.checked_sub(2) {
            Some(position) => format!("position {position} (counted from 0), "),
            None => String::new(),
        };
        anyhow!(
            "{at}column {}: {what}; give [[X, Y, Z], ...] or {{\"positions\": [[X, Y, Z], ...], \"age_ms\": AGE}}, finite \
             numbers, on one line",
            error.column()
        )
    })
}

fn is_text(byte: &u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}

//! The record of the ticks beside an instrument's path: what a filter admitted, and the energy budget of a wall.

use crate::tool::{self, Lines};
use anyhow::{Result, anyhow, bail, ensure};
use dibs_build::glam::DVec3;
use serde::Deserialize;
use std::path::Path;

/// A tick's line; a key that is null or absent means unknown.
#[derive(Deserialize)]
struct Line {
    tick: Option<usize>,
    /// The admitted pose, as the text of a tool.
    admitted: Option<String>,
    /// The least separation during the admitted motion (mm).
    least_separation: Option<f32>,
    reason: Option<String>,
    /// The energy that the wall may still give to the hand (mJ).
    energy: Option<f32>,
}

/// The record of a path's ticks.
#[derive(Default)]
pub struct Record {
    /// The admitted poses: of every tick, or empty.
    pub admitted: Vec<Vec<f32>>,
    /// For each tick: the reason's index, the separation and the energy, NaN if unknown.
    pub ticks: Vec<Vec<f32>>,
    /// The reasons as text, by index.
    pub reasons: Vec<String>,
}

impl Record {
    /// Reads a file with a line for each of the path's `count` ticks.
    pub fn read(path: &Path, count: usize, origin: DVec3) -> Result<Self> {
        let mut lines = Lines::open(path)?;
        let mut record = Self::default();
        while let Some(line) = lines.next()? {
            let Some(line) = line else { continue };
            let taken = record.take(&line, origin);
            taken.map_err(|error| anyhow!("{}, line {}: {error}", lines.name, lines.number))?;
        }
        let (name, found) = (&lines.name, record.ticks.len());
        ensure!(
            found == count,
            "{name}: {found} ticks, but --path has {count}; give the record of that path"
        );
        let admitted = record.admitted.len();
        ensure!(
            admitted == 0 || admitted == count,
            "{name}: {admitted} of {count} ticks have an admitted pose; give all"
        );
        Ok(record)
    }

    fn take(&mut self, line: &str, origin: DVec3) -> Result<()> {
        let line: Line = serde_json::from_str(line)
            .map_err(|error| anyhow!("{error}; give a line that `dibs filter --json` prints"))?;
        if let Some(tick) = line.tick
            && tick != self.ticks.len()
        {
            bail!("tick {tick} in the place of tick {}; give every tick once", self.ticks.len());
        }
        if let Some(pose) = line.admitted {
            self.admitted.push(tool::one(&pose)?.numbers(origin)?);
        }
        let reason = line.reason.map_or(f32::NAN, |reason| self.number(reason) as f32);
        let [least, energy] =
            [line.least_separation, line.energy].map(|value| value.unwrap_or(f32::NAN));
        self.ticks.push(vec![reason, least, energy]);
        Ok(())
    }

    /// The index of a reason.
    fn number(&mut self, reason: String) -> usize {
        let known = self.reasons.iter().position(|known| *known == reason);
        known.unwrap_or_else(|| {
            self.reasons.push(reason);
            self.reasons.len() - 1
        })
    }
}

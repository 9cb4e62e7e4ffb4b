//! A recorded motion in a tree's rows, played over and over, and a tool's path beside it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_nostd::{Index, MeasuredStretch, Tree, measure_stretch};

use crate::mesh_file::Lengths;
use crate::query::{ToolSpec, parse_tool, rows};

/// The surface in its motion, and the ticks of a loop.
#[derive(clap::Args)]
pub struct Moving {
    /// A tree file that `dibs build` wrote
    pub tree: PathBuf,
    /// The surface's motion: .pc2, .npy or a series (heart_%03d.vtp) of the built mesh
    #[arg(long)]
    pub motion: PathBuf,
    /// Frames a second of the motion; by default the number in its file
    #[arg(long, value_name = "HZ")]
    motion_rate: Option<f32>,
    /// Ticks a second
    #[arg(long, default_value_t = 1_000.0, allow_negative_numbers = true)]
    rate: f64,
    #[command(flatten)]
    lengths: Lengths,
}

impl Moving {
    /// Ticks a second: a rate that a clock can have.
    pub fn rate(&self) -> Result<f64> {
        let rate = self.rate;
        if !(rate > 0.0 && rate.is_finite()) {
            bail!("--rate is {rate}: give the ticks of a second");
        }
        Ok(rate)
    }

    /// Reads the motion's file.
    pub fn read<I: Index>(&self, tree: &Tree<'_, I>) -> Result<Recorded> {
        Recorded::read(tree, &self.motion, &self.lengths, self.motion_rate)
    }
}

/// The tool at each tick, as `each` has it.
pub fn tools<T>(path: &Path, each: impl Fn(ToolSpec) -> Result<T>) -> Result<Vec<T>> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let tools: Vec<T> = (1..)
        .zip(text.lines())
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(number, line)| {
            parse_tool(line.trim())
                .and_then(&each)
                .map_err(|error| anyhow!("{name}, line {number}: {error}"))
        })
        .collect::<Result<_>>()?;
    if tools.is_empty() {
        bail!("{name}: no line, and so no tick; give a tool for each tick");
    }
    Ok(tools)
}

/// The frames of a motion, at least one, within the tree's stretch limit.
pub struct Recorded {
    pub frames: Vec<Vec<Vec3>>,
    pub stretches: Vec<MeasuredStretch>,
    /// Frames a second.
    pub rate: f64,
}

impl Recorded {
    /// Reads a motion's file. `rate` replaces the number in it.
    fn read<I: Index>(
        tree: &Tree<'_, I>,
        path: &Path,
        lengths: &Lengths,
        rate: Option<f32>,
    ) -> Result<Self> {
        let motion = lengths.motion_of(tree, path)?;
        let rate = rate.unwrap_or(motion.rate);
        let name = path.display();
        if !(rate > 0.0) || motion.frames.is_empty() {
            let count = motion.frames.len();
            bail!("{name}: has {count} frames at {rate} a second; give --motion-rate");
        }
        let frames: Vec<Vec<Vec3>> = (0..)
            .zip(&motion.frames)
            .map(|(number, frame)| rows(tree, path, number, frame))
            .collect::<Result<_>>()?;
        let stretches = (0..)
            .zip(&frames)
            .map(|(number, frame)| {
                measure_stretch(tree, frame.as_slice()).map_err(|error| {
                    anyhow!(
                        "{name}, frame {number}: {error}; build the tree with a larger --stretch, or with \
                         --limits that allow it"
                    )
                })
            })
            .collect::<Result<_>>()?;
        Ok(Self { frames, stretches, rate: f64::from(rate) })
    }

    /// The frame that a time (s) falls behind, counted on over all rounds, and the share of the way to the next.
    pub fn at(&self, time: f64) -> (usize, f64) {
        let place = time * self.rate;
        (place as usize, place.fract())
    }
}

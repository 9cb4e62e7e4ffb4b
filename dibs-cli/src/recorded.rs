//! A recorded motion in a tree's rows, played over and over, and a tool's path beside it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use dibs_build::SurfaceRows;
use dibs_build::glam::Vec3;
use dibs_nostd::{Index, MeasuredStretch, PathKind, Tree};

use crate::mesh_file::Lengths;
use crate::query::{ToolSpec, parse_tool, rows};

/// The surface in its motion, and the ticks of a loop.
#[derive(clap::Args)]
pub struct Moving {
    /// A tree file that `dibs build` wrote
    pub tree: PathBuf,
    /// The surface's motion: .pc2, .npy or a series (heart_%03d.vtp) of the built mesh, or of
    /// the nodes that move it
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
    /// Positions of the tree's vertices.
    pub frames: Vec<Vec<Vec3>>,
    /// Positions of the nodes, of a tree with nodes.
    nodes: Option<Vec<Vec<Vec3>>>,
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
        let nodes = (tree.paths() == PathKind::Volume).then(|| frames.clone());
        let (mut rows, mut stretches) = (Vec::new(), Vec::new());
        for (number, frame) in frames.into_iter().enumerate() {
            let surface = SurfaceRows::of(tree, frame)?;
            let measured = surface.stretch.map_err(|error| {
                anyhow!(
                    "{name}, frame {number}: {error}; build the tree with a larger --stretch, or with \
                     --limits that allow it"
                )
            })?;
            rows.push(surface.positions().to_vec());
            stretches.push(measured);
        }
        Ok(Self { frames: rows, nodes, stretches, rate: f64::from(rate) })
    }

    /// The stretch of the surface after a frame, if it goes on as it came from another one; an error beyond the limit.
    pub fn stretch_beyond<I: Index>(
        &self,
        tree: &Tree<'_, I>,
        [before, after]: [usize; 2],
        share: f32,
    ) -> Result<MeasuredStretch> {
        let frames = self.nodes.as_ref().unwrap_or(&self.frames);
        let pairs = frames[before].iter().zip(&frames[after]);
        let beyond: Vec<Vec3> =
            pairs.map(|(before, after)| before + (after - before) * (1.0 + share)).collect();
        Ok(SurfaceRows::of(tree, beyond)?.stretch?)
    }

    /// The frame that a time (s) falls behind, counted on over all rounds, and the share of the way to the next.
    pub fn at(&self, time: f64) -> (usize, f64) {
        let place = time * self.rate;
        (place as usize, place.fract())
    }
}

//! A recorded motion in a tree's rows, which is repeated.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_build::{Motion, SurfaceRows};
use dibs_nostd::{Index, MeasuredStretch, PathKind, Tree};

use crate::mesh_file::Lengths;
use crate::motion::{MotionFile, MotionRate};
use crate::query::{ALLOW, rows};

/// The options for a moving surface, and for the ticks of a control loop.
#[derive(clap::Args)]
#[command(mut_arg("motion", |motion| motion.required(true)))]
pub struct MovingArgs {
    /// A tree file that `dibs build` wrote
    pub tree: PathBuf,
    #[command(flatten)]
    motion: MotionFile,
    #[command(flatten)]
    motion_rate: MotionRate,
    /// Ticks a second of the control loop
    #[arg(long, value_name = "HZ", default_value_t = 1_000.0)]
    rate: f64,
    #[command(flatten)]
    lengths: Lengths,
}

impl MovingArgs {
    /// Ticks a second: above 0 and finite.
    pub fn rate(&self) -> Result<f64> {
        let rate = self.rate;
        if !(rate > 0.0 && rate.is_finite()) {
            bail!("--rate is {rate}: give the ticks of a second");
        }
        Ok(rate)
    }

    /// The motion's file.
    pub fn motion(&self) -> Result<&PathBuf> {
        self.motion.required()
    }

    /// Reads the motion's file.
    pub fn read<I: Index>(&self, tree: &Tree<'_, I>) -> Result<RecordedFrames> {
        let path = self.motion()?;
        let motion = self.lengths.motion_of(tree, path)?;
        let rate = self.motion_rate.of(&motion, path)?;
        RecordedFrames::new(tree, path, &motion, rate)
    }
}

/// The frames of a motion, at least one, within the tree's stretch limit.
pub struct RecordedFrames {
    /// Positions of the tree's vertices.
    pub frames: Vec<Vec<Vec3>>,
    /// Positions of the nodes, for a tree with nodes.
    nodes: Option<Vec<Vec<Vec3>>>,
    pub stretches: Vec<MeasuredStretch>,
    /// Frames a second.
    pub rate: f64,
}

impl RecordedFrames {
    fn new<I: Index>(tree: &Tree<'_, I>, path: &Path, motion: &Motion, rate: f64) -> Result<Self> {
        let name = path.display();
        let frames: Vec<Vec<Vec3>> = (0..)
            .zip(&motion.frames)
            .map(|(number, frame)| rows(tree, path, number, frame))
            .collect::<Result<_>>()?;
        let nodes = (tree.paths() == PathKind::Volume).then(|| frames.clone());
        let (mut rows, mut stretches) = (Vec::new(), Vec::new());
        for (number, frame) in frames.into_iter().enumerate() {
            let surface = SurfaceRows::of(tree, frame)?;
            let measured = surface.stretch.map_err(|error| {
                let refused = SurfaceRows::refusal(tree, error, ALLOW);
                anyhow!("{name}, frame {number}: {refused}")
            })?;
            rows.push(surface.positions().to_vec());
            stretches.push(measured);
        }
        Ok(Self { frames: rows, nodes, stretches, rate })
    }

    /// The stretch after a frame if the motion from the previous frame continues; an error beyond the limit.
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

    /// The frame before a time (s), counted over all repetitions, and the fraction of the interval to the next frame.
    pub fn at(&self, time: f64) -> (usize, f64) {
        let place = time * self.rate;
        (place as usize, place.fract())
    }
}

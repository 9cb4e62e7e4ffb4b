//! A recorded motion in a tree's rows, played over and over.

use std::path::Path;

use anyhow::{Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_nostd::{Index, MeasuredStretch, Tree, measure_stretch};

use crate::mesh_file::Lengths;
use crate::query::rows;

/// The frames of a motion, at least one, within the tree's stretch limit.
pub struct Recorded {
    pub frames: Vec<Vec<Vec3>>,
    pub stretches: Vec<MeasuredStretch>,
    /// Frames a second.
    pub rate: f64,
}

impl Recorded {
    /// Reads a motion's file. `rate` replaces the number in it.
    pub fn read<I: Index>(
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

/// A rate of ticks that a clock can have.
pub fn checked_rate(rate: f64) -> Result<f64> {
    if !(rate > 0.0 && rate.is_finite()) {
        bail!("--rate is {rate}: give the ticks of a second");
    }
    Ok(rate)
}

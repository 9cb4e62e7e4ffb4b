//! A motion and its rate, with the same options for every command.

use anyhow::{Context, Result, bail};
use dibs_build::Motion;
use std::path::{Path, PathBuf};

/// A motion's file.
#[derive(clap::Args)]
pub struct MotionFile {
    /// The surface's motion: .pc2, .npy or a series (heart_%03d.vtp) of the built mesh, or of
    /// the nodes that move it
    #[arg(long)]
    motion: Option<PathBuf>,
    /// The motion's file without an option's name, as in earlier versions
    #[arg(hide = true, value_name = "MOTION", conflicts_with = "motion")]
    unnamed_motion: Option<PathBuf>,
}

impl MotionFile {
    /// The file, if one is given.
    pub fn given(&self) -> Option<&PathBuf> {
        self.motion.as_ref().or(self.unnamed_motion.as_ref())
    }

    /// The file, for a command that requires it.
    pub fn required(&self) -> Result<&PathBuf> {
        self.given().context("no motion; give --motion")
    }
}

/// A motion's rate.
#[derive(clap::Args)]
pub struct MotionRate {
    /// Frames a second of the motion; by default the number in its file
    #[arg(long, value_name = "HZ")]
    motion_rate: Option<f64>,
}

impl MotionRate {
    /// Frames a second of a motion that has at least one frame.
    pub fn of(&self, motion: &Motion, path: &Path) -> Result<f64> {
        let name = path.display();
        if motion.frames.is_empty() {
            bail!("{name}: the motion has no frame");
        }
        let rate = match self.motion_rate {
            Some(rate) => rate,
            None if motion.rate > 0.0 => motion.rate.into(),
            None => {
                bail!("{name}: the file does not say how fast it was recorded; give --motion-rate")
            }
        };
        if !is_possible(rate) {
            bail!("{name}: {rate} {WRONG}");
        }
        Ok(rate)
    }

    /// The given frames a second, if any.
    pub fn given(&self) -> Result<Option<f64>> {
        match self.motion_rate {
            Some(rate) if !is_possible(rate) => bail!("{rate} {WRONG}"),
            rate => Ok(rate),
        }
    }
}

const WRONG: &str = "frames a second; give a --motion-rate from 0.001 to 100000";

fn is_possible(rate: f64) -> bool {
    (1e-3..=1e5).contains(&rate)
}

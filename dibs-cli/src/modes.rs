//! Displacement modes for `dibs build` and `dibs stream`.

use crate::mesh_file::{Lengths, spinner};
use crate::tree_file::{self, AnyTree};
use anyhow::{Result, anyhow};
use dibs_build::modes::{ModalError, ModalFit, Projector};
use dibs_build::{BuiltTree, Mesh, Motion};
use dibs_nostd::modes::Modes;
use dibs_stream::SurfaceOrder;
use std::path::{Path, PathBuf};

/// The modes fitted to a motion file.
pub struct Fit {
    path: PathBuf,
    fit: ModalFit,
}

/// Fits modes to a motion file.
pub fn fit(mesh: &Mesh, path: &Path, lengths: &Lengths) -> Result<Fit> {
    let motion = lengths.motion(path, mesh.origin)?;
    let spinner = spinner("fitting modes to the motion");
    let fit = ModalFit::new(mesh, &motion);
    spinner.finish_and_clear();
    let fit = fit.map_err(|error| anyhow!("{}: {error}", path.display()))?;
    Ok(Fit { path: path.to_path_buf(), fit })
}

impl Fit {
    /// Adds modes to a tree, and warns about frames that a controller would reject.
    pub fn add(&self, tree: &BuiltTree, count: usize) -> Result<BuiltTree> {
        let name = self.path.display();
        let tree = tree.with_modes(&self.fit, count).map_err(|error| anyhow!("{name}: {error}"))?;
        if let Some(motion) = tree.modal_motion()
            && let Some(first) = motion.beyond_limit.first()
        {
            eprintln!(
                "warning: {name}: {} of {} frames (the first is frame {first}) stretch the surface \
                 beyond the limit of {}: a controller rejects them, build with a larger --stretch",
                motion.beyond_limit.len(),
                motion.weights.len(),
                tree.summary().stretch
            );
        }
        Ok(tree)
    }

    /// The error of every number of modes.
    pub fn errors(&self) -> &[ModalError] {
        self.fit.errors()
    }

    /// Prints the errors for each number of modes.
    pub fn print(&self, chosen: usize) {
        println!("motion   {}: modes against its largest and RMS error", self.path.display());
        for error in self.errors() {
            let modes = error.modes;
            let is_last = modes == self.fit.available();
            if modes <= 4 || modes % 4 == 0 || modes == chosen || is_last {
                let mark = if modes == chosen { "  <- written" } else { "" };
                println!("         {modes:4} {:11.6} {:11.6}{mark}", error.max, error.rms);
            }
        }
    }
}

/// The weights of a motion's frames for the modes of a tree file, all within a receiver's ranges.
pub fn weights(path: &Path, order: &SurfaceOrder, motion: &Motion) -> Result<Vec<Vec<f32>>> {
    let bytes = tree_file::load(path)?;
    let name = path.display();
    let modes = match tree_file::validate(&bytes, path)? {
        AnyTree::Narrow(tree) => Modes::of(&tree),
        AnyTree::Wide(tree) => Modes::of(&tree),
    }
    .map_err(|error| anyhow!("{name}: {error}; build it with --motion and --modes"))?;
    let projector = Projector::new(&modes).map_err(|error| anyhow!("{name}: {error}"))?;
    let of_frame = |(frame, positions): (usize, &Vec<_>)| {
        let rows = order.to_rows(positions).map_err(|error| anyhow!("{name}: {error}"))?;
        let weights = projector.weights(&rows);
        modes.check(&weights).map_err(|error| {
            anyhow!(
                "{name}: frame {frame} cannot be sent: {error}; build the tree with modes of this \
                 motion"
            )
        })?;
        Ok(weights)
    };
    motion.frames.iter().enumerate().map(of_frame).collect()
}

//! Proper orthogonal decomposition of a recorded motion into a few displacement fields.

use dibs_nostd::modes::MAX_MODES;
use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::{FitError, MAX_FRAMES, ModalError};
use crate::{Mesh, Motion};

/// A direction with less than this fraction of the motion's energy counts as rounding: a millionth of the motion's
/// size, squared.
const NOISE: f64 = 1e-12;

/// The displacement modes of a recorded motion, by energy, the largest first.
///
/// The displacements of all frames from the rest shape are decomposed (proper orthogonal decomposition, by the
/// snapshots' small Gram matrix: Sirovich, Quart. Appl. Math. 45, 1987), with equal weight for each vertex: no other
/// `k` fields leave a smaller RMS error. A mode's largest weight in any frame is 1. The same input always gives the
/// same modes.
///
/// ```
/// use dibs_build::{generate, modes::ModalFit};
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
/// let fit = ModalFit::new(&heart, &motion)?;
/// // The error by number of modes, before one is chosen: this motion has two.
/// let [one, two] = fit.errors() else { panic!("other modes") };
/// assert!(one.max > 1.0 && two.max < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ModalFit {
    /// For each mode the displacement of each mesh vertex at weight 1.
    pub(super) modes: Vec<Vec<DVec3>>,
    /// Positions of the rest shape and of the recorded frames, in the mesh's order.
    pub(super) rest: Vec<Vec3>,
    pub(super) frames: Vec<Vec<Vec3>>,
    errors: Vec<ModalError>,
}

impl ModalFit {
    /// Decomposes a motion.
    ///
    /// Cost: `f^2` dot products over the vertices for `f` frames, on all cores, and an eigenvalue
    /// problem of size `f`.
    ///
    /// # Errors
    /// [`FitError`] for a motion that does not fit the mesh, has no frame, too many of them or a
    /// coordinate that is not finite, or does not move.
    pub fn new(mesh: &Mesh, motion: &Motion) -> Result<Self, FitError> {
        motion.check_fits(mesh)?;
        if !(1..=MAX_FRAMES).contains(&motion.frames.len()) {
            return Err(FitError::Frames { frames: motion.frames.len() });
        }
        for (frame, positions) in motion.frames.iter().enumerate() {
            if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
                return Err(FitError::Coordinate { frame, vertex });
            }
        }
        let displacements: Vec<Vec<DVec3>> = motion
            .frames
            .iter()
            .map(|frame| {
                let pairs = frame.iter().zip(&mesh.positions);
                pairs.map(|(now, rest)| now.as_dvec3() - rest.as_dvec3()).collect()
            })
            .collect();
        let modes = decompose(&displacements);
        if modes.is_empty() {
            return Err(FitError::Still);
        }
        let errors = errors(displacements, &modes);
        let (rest, frames) = (mesh.positions.clone(), motion.frames.clone());
        Ok(Self { modes, rest, frames, errors })
    }

    /// Error of the first `k` modes over all frames and vertices, for each `k` from 1 on, before the modes are rounded.
    #[must_use]
    pub fn errors(&self) -> &[ModalError] {
        &self.errors
    }

    /// Number of modes: one for each independent frame, at most 64.
    #[must_use]
    pub fn available(&self) -> usize {
        self.modes.len()
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn decompose(displacements: &[Vec<DVec3>]) -> Vec<Vec<DVec3>> {
    let count = displacements.len();
    let rows: Vec<Vec<f64>> = displacements
        .par_iter()
        .enumerate()
        .map(|(i, a)| displacements[..=i].iter().map(|b| dot(a, b)).collect())
        .collect();
    let gram = DMatrix::from_fn(count, count, |i, j| rows[i.max(j)][i.min(j)]);
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let largest = order.first().map_or(0.0, |&i| eigen.eigenvalues[i]);
    let significant = |&i: &usize| eigen.eigenvalues[i] > NOISE * largest;
    order
        .into_iter()
        .take_while(significant)
        .take(MAX_MODES)
        .map(|i| {
            // The weights are `sqrt(value) u`, and the mode is the sum of `u_f d_f / sqrt(value)`. Both are scaled so
            // that the largest weight is 1, and positive.
            let u = eigen.eigenvectors.column(i);
            let peak =
                u.iter().fold(0.0, |peak: f64, w| if w.abs() > peak.abs() { *w } else { peak });
            let mut mode = vec![DVec3::ZERO; displacements[0].len()];
            for (weight, displacement) in u.iter().zip(displacements) {
                for (sum, d) in mode.iter_mut().zip(displacement) {
                    *sum += *d * (weight * peak);
                }
            }
            mode
        })
        .collect()
}

/// The error that remains after each mode is subtracted from the displacements.
fn errors(mut left: Vec<Vec<DVec3>>, modes: &[Vec<DVec3>]) -> Vec<ModalError> {
    (1..)
        .zip(modes)
        .map(|(count, mode)| {
            let size = dot(mode, mode);
            let of_frames: Vec<[f64; 2]> = left
                .par_iter_mut()
                .map(|frame| {
                    let weight = dot(frame, mode) / size;
                    let mut worst = [0.0_f64; 2];
                    for (d, m) in frame.iter_mut().zip(mode) {
                        *d -= *m * weight;
                        worst = [worst[0].max(d.length_squared()), worst[1] + d.length_squared()];
                    }
                    worst
                })
                .collect();
            let squares: f64 = of_frames.iter().map(|[_, sum]| sum).sum();
            let max = of_frames.iter().map(|[max, _]| *max).fold(0.0, f64::max);
            let points = (left.len() * mode.len()) as f64;
            ModalError { modes: count, max: max.sqrt(), rms: (squares / points).sqrt() }
        })
        .collect()
}

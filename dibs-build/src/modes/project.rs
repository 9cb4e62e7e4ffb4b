//! From positions to weights, for senders.

use dibs_nostd::modes::Modes;
use glam::{DVec3, Vec3};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::FitError;

/// Finds the weights of the modal surface nearest to given positions, by least squares over all vertices.
///
/// ```
/// use dibs_build::{Builder, generate, modes::{ModalFit, Projector}};
/// use dibs_nostd::{Tree, modes::Modes};
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
/// let fit = ModalFit::new(&heart, &motion)?;
/// let built = Builder::new().build(&heart)?.with_modes(&fit, 2)?;
///
/// // The imaging side needs the tree's bytes and the positions, in the tree's order.
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let projector = Projector::new(&Modes::of(&tree)?)?;
/// let weights = projector.weights(&built.to_rows(&motion.frames[9]));
/// assert_eq!(weights, built.modal_motion().expect("has modes").weights[9]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Projector {
    /// For each mode the displacement of each row at weight 1.
    modes: Vec<Vec<DVec3>>,
    rest: Vec<DVec3>,
    normal: Cholesky<f64, Dyn>,
}

impl Projector {
    /// A projector for the modes of a tree.
    ///
    /// # Errors
    /// [`FitError::Degenerate`] if one mode is a combination of others.
    pub fn new(modes: &Modes<'_>) -> Result<Self, FitError> {
        let rows = 0..modes.vertex_count();
        let displacements = |mode| {
            let step = f64::from(modes.step(mode).unwrap_or_default());
            let of_row = |row| modes.displacement(mode, row).unwrap_or_default().map(f64::from);
            rows.clone().map(|row| DVec3::from(of_row(row)) * step).collect()
        };
        let rest = |row| modes.rest_position(row).unwrap_or_default().as_dvec3();
        Self::from_displacements(
            (0..modes.count()).map(displacements).collect(),
            rows.clone().map(rest).collect(),
        )
    }

    pub(super) fn from_displacements(
        modes: Vec<Vec<DVec3>>,
        rest: Vec<DVec3>,
    ) -> Result<Self, FitError> {
        let products = DMatrix::from_fn(modes.len(), modes.len(), |i, j| dot(&modes[i], &modes[j]));
        let normal = Cholesky::new(products).ok_or(FitError::Degenerate)?;
        Ok(Self { modes, rest, normal })
    }

    /// The weights for these positions (mm), in the tree's vertex order. They may be outside of the modes' range: check
    /// them with `dibs_nostd::modes::Modes::check`.
    ///
    /// # Panics
    /// If there is not one position for each of the tree's vertices.
    #[must_use]
    pub fn weights(&self, rows: &[Vec3]) -> Vec<f32> {
        assert_eq!(rows.len(), self.rest.len(), "one position for each of the tree's vertices");
        let displacement: Vec<DVec3> =
            rows.iter().zip(&self.rest).map(|(now, rest)| now.as_dvec3() - *rest).collect();
        let right = self.modes.iter().map(|mode| dot(mode, &displacement));
        let right = DVector::from_iterator(self.modes.len(), right);
        self.normal.solve(&right).iter().map(|weight| *weight as f32).collect()
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

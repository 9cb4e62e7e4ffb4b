//! Modal surfaces for the tests.

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, BuiltTree};
use dibs_nostd::VertexTable;
use dibs_nostd::modes::Modes;
use fastrand::Rng;
use glam::Vec3;

use crate::motions::trembling;

/// The positions of all rows of a table.
///
/// # Panics
/// If a row is missing.
#[must_use]
pub fn positions(surface: &impl VertexTable) -> Vec<Vec3> {
    let rows = 0..surface.len() as u32;
    rows.map(|row| surface.position(row).expect("in the table")).collect()
}

/// Random weights in the admitted ranges.
///
/// # Panics
/// If a mode has no range.
#[must_use]
pub fn anywhere(modes: &Modes<'_>, rng: &mut Rng) -> Vec<f32> {
    let range = |mode| modes.range(mode).expect("there is one");
    let within = |[low, high]: [f32; 2]| (low + (high - low) * rng.f32()).clamp(low, high);
    (0..modes.count()).map(range).map(within).collect()
}

/// A small heart's tree with `count` modes, and their fit.
///
/// # Panics
/// If it has no such modes.
#[must_use]
pub fn small(count: usize) -> (BuiltTree, ModalFit) {
    let (mesh, motion) = trembling(320, 3, 6);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let tree = Builder::new().stretch(3.0).build(&mesh).expect("a valid mesh");
    (tree.with_modes(&fit, count).expect("so many"), fit)
}

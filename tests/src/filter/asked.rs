//! Records a filter's inputs, so that another machine can be tested with the same.

use dibs_nostd::filter::{AdmittedMotion, RigidMotion};
use glam::Vec3;

/// The settings of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    /// Stand-off (mm).
    pub stand_off: f32,
    /// Labels with a stand-off (mm) of their own.
    pub labels: &'a [(u8, f32)],
    /// The robot's largest speed (mm/s).
    pub robot: f32,
    /// Time constant of the approach (s).
    pub approach: f32,
    /// Instruction budget of a tick.
    pub instructions: u32,
    /// Period (s).
    pub period: f32,
    /// Whether queries use the measured stretch of both frames.
    pub is_measured: bool,
}

/// A tick, and its answer.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// The fraction of the interval between the last two frames; `None` for the last frame.
    pub share: Option<f32>,
    /// The instrument's joints.
    pub joints: [Vec3; 3],
    /// Its capsules' radii.
    pub radii: [f32; 2],
    /// The command, about the first joint.
    pub command: RigidMotion,
    /// The tissue's speed (mm/s), and two errors (mm).
    pub tissue: [f32; 3],
    /// The answer.
    pub admitted: AdmittedMotion,
}

/// Receives the inputs of a walk.
pub trait Listener {
    /// A walk starts.
    fn walk(&mut self, settings: &Settings<'_>);
    /// A new frame, in the tree's order.
    fn frame(&mut self, rows: &[Vec3]);
    /// A tick.
    fn tick(&mut self, asked: &Asked);
}

/// Ignores all inputs.
impl Listener for () {
    fn walk(&mut self, _: &Settings<'_>) {}
    fn frame(&mut self, _: &[Vec3]) {}
    fn tick(&mut self, _: &Asked) {}
}

//! What a filter was asked, so that another machine can be asked the same.

use dibs_nostd::filter::{Admitted, Motion};
use glam::Vec3;

/// A walk's numbers.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// mm.
    pub stand_off: f32,
    /// The robot's largest speed (mm/s).
    pub robot: f32,
    /// Time constant of the approach (s).
    pub approach: f32,
    /// Instructions of a tick's queries.
    pub instructions: u32,
    /// s.
    pub period: f32,
    /// Whether queries take the measured stretch of both frames.
    pub is_measured: bool,
}

/// A tick, and its answer.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// How far the surface is on the way between the last two frames; `None` for the last one.
    pub share: Option<f32>,
    /// The instrument's joints.
    pub joints: [Vec3; 3],
    /// Its capsules' radii.
    pub radii: [f32; 2],
    /// About the first joint.
    pub command: Motion,
    /// The tissue's speed (mm/s), and two errors (mm).
    pub tissue: [f32; 3],
    /// The answer.
    pub admitted: Admitted,
}

/// Hears what a walk asks.
pub trait Listener {
    /// A walk begins.
    fn walk(&mut self, settings: &Settings);
    /// A new frame, in the tree's order.
    fn frame(&mut self, rows: &[Vec3]);
    /// A tick.
    fn tick(&mut self, asked: &Asked);
}

/// Nobody.
impl Listener for () {
    fn walk(&mut self, _: &Settings) {}
    fn frame(&mut self, _: &[Vec3]) {}
    fn tick(&mut self, _: &Asked) {}
}

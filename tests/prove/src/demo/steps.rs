//! The steps of the force at new frames: on the extrapolated surface, and on one that is held between frames.

use anyhow::{Context, Result};
use controller::telemetry::Tick;
use controller::{MARGIN, SPRING, TICK_RATE};
use dibs_nostd::constraint::ForbiddenRegion;
use dibs_nostd::failsafe::State;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Index, Options, Query, Tool, Tree};
use glam::Vec3;
use serde::Serialize;

use super::report::force;
use super::scene::Scene;
use super::sender::Link;

/// The steps of the force's magnitude from the last tick of a frame to the first tick of the next.
#[derive(Clone, Copy, Default, Serialize)]
pub struct Steps {
    /// New frames at which the output was not safe, and the instrument's axis was outside the surface. Inside, the
    /// force is at its maximum.
    new_frames: usize,
    /// Steps of the controller's force, in N.
    force_step_continuous_mean_n: f64,
    force_step_continuous_max_n: f64,
    /// The tick of the largest step.
    force_step_continuous_max_tick: u32,
    /// The same for the force of the same wall, instrument and margin on a surface that is held from frame to frame.
    force_step_held_mean_n: f64,
    force_step_held_max_n: f64,
    /// Largest error of an extrapolation when the next frame arrives, in mm.
    extrapolation_error_max_mm: f32,
    /// Fraction of the answered ticks on a surface that was extrapolated beyond its frame.
    moved_on: f64,
}

impl Steps {
    /// The steps of a run.
    pub fn of(scene: &Scene, link: &Link, ticks: &[Tick]) -> Result<Self> {
        match scene.tree.index_bits() {
            16 => Self::on(&scene.tree.tree::<u16>()?, scene, link, ticks),
            _ => Self::on(&scene.tree.tree::<u32>()?, scene, link, ticks),
        }
    }

    fn on<I: Index>(
        tree: &Tree<'_, I>,
        scene: &Scene,
        link: &Link,
        ticks: &[Tick],
    ) -> Result<Self> {
        let wall = ForbiddenRegion::new(SPRING, MARGIN)?;
        let mut query = Query::<I, MAX_STACK>::new(tree)?;
        let mut held = |before: &Tick, tick: &Tick| -> Result<(f32, bool)> {
            let rows = link.frame(tick.epoch).context("a frame that was never sent")?;
            let rows = scene.vertices(&rows);
            let (was, tool) = (tool(before)?, tool(tick)?);
            let found = query.closest(&*rows, &tool, &Options::new())?;
            let (start, end) = (tool.start() - was.start(), tool.end() - was.end());
            let velocity = start.lerp(end, found.axis_parameter) * TICK_RATE as f32;
            let margin = tick.margin + tick.position_error;
            let force = wall.force(&Ok(found.widened(margin)), velocity).force.length();
            Ok((force, found.separation > -tool.radius()))
        };
        let mut steps = Self::default();
        for three in ticks.windows(3) {
            let [first, last, new] = three else { continue };
            let is_acting = |tick: &Tick| tick.is_answered() && tick.state != State::Safe as u32;
            if !three.iter().all(is_acting) || last.epoch == new.epoch {
                continue;
            }
            let is_outside = |tick: &Tick| tick.separation > -tick.tool_radius;
            let (old, old_outside) = held(first, last)?;
            let (next, next_outside) = held(last, new)?;
            let continuous = f64::from((force(last) - force(new)).abs());
            let is_outside = is_outside(last) && is_outside(new) && old_outside && next_outside;
            if !is_outside {
                continue;
            }
            let held = f64::from((old - next).abs());
            steps.new_frames += 1;
            steps.force_step_continuous_mean_n += continuous;
            if continuous > steps.force_step_continuous_max_n {
                steps.force_step_continuous_max_n = continuous;
                steps.force_step_continuous_max_tick = new.tick;
            }
            steps.force_step_held_mean_n += held;
            steps.force_step_held_max_n = steps.force_step_held_max_n.max(held);
        }
        let frames = steps.new_frames.max(1) as f64;
        steps.force_step_continuous_mean_n /= frames;
        steps.force_step_held_mean_n /= frames;
        let answered = || ticks.iter().filter(|tick| tick.is_answered());
        let moved = answered().filter(|tick| tick.blend > 1.0).count();
        steps.moved_on = moved as f64 / answered().count().max(1) as f64;
        let errors = ticks.iter().map(|tick| tick.residual);
        steps.extrapolation_error_max_mm = errors.fold(0.0, f32::max);
        Ok(steps)
    }

    /// A line for the user.
    pub fn row(&self) -> String {
        format!(
            "{:.2} N in the mean over {} new frames, {:.2} at most at tick {}; {:.2} and {:.2} were the surface held; \
             extrapolations off by {:.2} mm at most, {:.0} % of the ticks on one",
            self.force_step_continuous_mean_n,
            self.new_frames,
            self.force_step_continuous_max_n,
            self.force_step_continuous_max_tick,
            self.force_step_held_mean_n,
            self.force_step_held_max_n,
            self.extrapolation_error_max_mm,
            self.moved_on * 100.0
        )
    }
}

/// A tick's instrument.
pub fn tool(tick: &Tick) -> Result<Capsule> {
    let (start, end) = (Vec3::from(tick.tool_start), Vec3::from(tick.tool_end));
    Ok(Capsule::new(start, end, tick.tool_radius)?)
}

//! The rows of the surface that a tick searched, between or beyond two frames.

use anyhow::{Context, Result};
use controller::telemetry::Tick;
use glam::Vec3;

use super::sender::Link;

/// The vertex rows, or the nodes, at a tick, computed with the same sums as `dibs_nostd::SurfaceBlend`.
pub fn rows(link: &Link, tick: &Tick) -> Result<Vec<Vec3>> {
    let frame = |epoch| {
        link.frame(epoch)
            .with_context(|| format!("tick {} used frame {epoch}, never sent", tick.tick))
    };
    let (before, after) = (frame(tick.epoch_before)?, frame(tick.epoch)?);
    let moved = |(&before, &after): (&Vec3, &Vec3)| before + (after - before) * tick.blend;
    Ok(before.iter().zip(after.iter()).map(moved).collect())
}

//! Checks the force of a tick, from its record alone.

use controller::telemetry::Tick;
use controller::{DAMPING, MARGIN, MAX_FORCE, STIFFNESS, TICK_RATE};
use dibs_nostd::failsafe::State;
use glam::{DVec3, Vec3};

/// Least distance (mm) of the axis from the surface: below, the direction between them is not exact enough, and a
/// crossing axis has another.
const CLEAR: f64 = 0.5;

/// How far a force may be off, in N.
const TOLERANCE: f64 = 0.01;

/// The forces of a run.
#[derive(Clone, Copy, Default)]
pub struct Pushed {
    /// Ticks whose force was checked: the instrument's axis is outside.
    pub checked: usize,
    /// Of these, the ones within the wall's margin.
    pub pushing: usize,
    /// Ticks with another force than the wall's, and the first of them.
    pub wrong: usize,
    pub first: u32,
}

impl Pushed {
    /// Checks every tick that can be.
    pub fn of(ticks: &[Tick]) -> Self {
        let mut pushed = Self::default();
        for pair in ticks.windows(2) {
            let [before, tick] = pair else { continue };
            let Some(expected) = expected(before, tick) else { continue };
            pushed.checked += 1;
            pushed.pushing += usize::from(expected != DVec3::ZERO);
            let off = (Vec3::from(tick.force).as_dvec3() - expected).length();
            // A NaN is wrong, too.
            if off.is_nan() || off > TOLERANCE {
                if pushed.wrong == 0 {
                    pushed.first = tick.tick;
                }
                pushed.wrong += 1;
            }
        }
        pushed
    }
}

/// The force of a spring and a damper between the surface and the point of the axis that is nearest to it; `None` where
/// the record does not tell.
fn expected(before: &Tick, tick: &Tick) -> Option<DVec3> {
    if !tick.is_answered() || tick.state == State::Safe as u32 || before.tick + 1 != tick.tick {
        return None;
    }
    let ends = |tick: &Tick| [tick.tool_start, tick.tool_end].map(|end| Vec3::from(end).as_dvec3());
    let ([start, end], [was_start, was_end]) = (ends(tick), ends(before));
    let surface = Vec3::from(tick.point_on_surface).as_dvec3();
    let axis = end - start;
    let along = ((surface - start).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    let away = start + axis * along - surface;
    let is_outside = f64::from(tick.separation) > CLEAR - f64::from(tick.tool_radius);
    if !is_outside || away.length() < CLEAR {
        return None;
    }
    let direction = away.normalize();
    let moved = (start - was_start).lerp(end - was_end, along);
    let flow = Vec3::from(tick.surface_velocity).as_dvec3();
    let speed = (moved * f64::from(TICK_RATE) - flow).dot(direction);
    let separation = f64::from(tick.lower) - f64::from(tick.accuracy) - f64::from(tick.margin);
    let depth = f64::from(MARGIN) - separation;
    if depth <= 0.0 {
        return Some(DVec3::ZERO);
    }
    let force = f64::from(STIFFNESS) * depth - f64::from(DAMPING) * speed;
    Some(direction * force.clamp(0.0, f64::from(MAX_FORCE)))
}

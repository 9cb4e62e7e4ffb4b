//! Checks the force of a tick, from its record alone.

use controller::telemetry::Tick;
use controller::{DAMPING, MARGIN, MAX_FORCE, STIFFNESS, TICK_RATE};
use dibs_nostd::failsafe::State;
use glam::{DVec3, Vec3};

use super::check::accuracy_of;

/// Least distance (mm) of the axis from the surface: for smaller distances the direction between them is not accurate
/// enough, and a crossing axis has another direction.
const CLEAR: f64 = 0.5;

/// Tolerance of a force, in N: along its direction, and across it for the largest force.
const TOLERANCE: f64 = 0.01;

/// The forces of a run.
#[derive(Clone, Copy, Default)]
pub struct Pushed {
    /// Ticks whose force was checked: those with the instrument's axis outside.
    pub checked: usize,
    /// Checked ticks within the wall's margin.
    pub pushing: usize,
    /// Checked ticks whose search a budget ended, so that they push along the last tick's direction, or from the last
    /// tick's pair where it is now.
    pub kept: usize,
    /// Ticks with a wrong force, or a direction that is not the pair's; and the first of them.
    pub wrong: usize,
    pub first: u32,
}

impl Pushed {
    /// Checks every tick whose record suffices.
    pub fn of(ticks: &[Tick]) -> Self {
        let mut pushed = Self::default();
        for pair in ticks.windows(2) {
            let [before, tick] = pair else { continue };
            let Some(expected) = Expected::of(before, tick) else { continue };
            pushed.checked += 1;
            pushed.pushing += usize::from(expected.force != DVec3::ZERO);
            let off = (Vec3::from(tick.force).as_dvec3() - expected.force).length();
            let is_pair = expected.turned * f64::from(MAX_FORCE) <= TOLERANCE
                && expected.farther <= accuracy_of(tick);
            let is_last = tick.direction == before.direction || expected.is_last_pair;
            let is_kept = !is_pair && is_cut(tick) && is_last;
            pushed.kept += usize::from(is_kept);
            // NaN counts as wrong.
            let is_right = off <= TOLERANCE && (is_pair || is_kept);
            if !is_right {
                if pushed.wrong == 0 {
                    pushed.first = tick.tick;
                }
                pushed.wrong += 1;
            }
        }
        pushed
    }
}

/// Whether a budget ended the search: the interval is wider than its rounding.
fn is_cut(tick: &Tick) -> bool {
    f64::from(tick.separation) - f64::from(tick.lower) > 2.0 * accuracy_of(tick)
}

/// The force that is expected from a tick's record.
struct Expected {
    /// The force of a spring and a damper along the recorded direction, in N.
    force: DVec3,
    /// Angle (radians) between the recorded direction and that of the recorded points.
    turned: f64,
    /// Whether the pair has the last tick's triangle and axis parameter, and its direction follows from their present
    /// positions.
    is_last_pair: bool,
    /// Distance (mm) of the axis' recorded point minus that of its nearest point. If the axis is parallel to the
    /// surface, many points are nearest within rounding, and each has its own direction.
    farther: f64,
}

impl Expected {
    /// `None` if the record does not suffice.
    fn of(before: &Tick, tick: &Tick) -> Option<Self> {
        if !tick.is_answered() || tick.state == State::Safe as u32 || before.tick + 1 != tick.tick {
            return None;
        }
        let ends =
            |tick: &Tick| [tick.tool_start, tick.tool_end].map(|end| Vec3::from(end).as_dvec3());
        let ([start, end], [was_start, was_end]) = (ends(tick), ends(before));
        let surface = Vec3::from(tick.point_on_surface).as_dvec3();
        let axis = end - start;
        let nearest = ((surface - start).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        let distance = (start + axis * nearest - surface).length();
        let is_outside = f64::from(tick.separation) > CLEAR - f64::from(tick.tool_radius);
        if !is_outside || distance < CLEAR {
            return None;
        }
        let along = f64::from(tick.axis_parameter);
        let away = start + axis * along - surface;
        let direction = Vec3::from(tick.direction).as_dvec3();
        let moved = (start - was_start).lerp(end - was_end, along);
        let flow = Vec3::from(tick.surface_velocity).as_dvec3();
        let speed = (moved * f64::from(TICK_RATE) - flow).dot(direction);
        let separation = f64::from(tick.lower) - f64::from(tick.accuracy) - f64::from(tick.margin);
        let depth = f64::from(MARGIN) - separation;
        let force = f64::from(STIFFNESS) * depth - f64::from(DAMPING) * speed;
        let size = if depth > 0.0 { force.clamp(0.0, f64::from(MAX_FORCE)) } else { 0.0 };
        let turned = (direction - away.normalize()).length();
        let is_same =
            tick.triangle == before.triangle && tick.axis_parameter == before.axis_parameter;
        Some(Self {
            force: direction * size,
            turned,
            is_last_pair: is_same && turned * f64::from(MAX_FORCE) <= TOLERANCE,
            farther: away.length() - distance,
        })
    }
}

//! The fail-safe machine's changes of state in a run.

use std::fmt;

use controller::TICK_RATE;
use controller::telemetry::{Tick, cause_name};
use serde::Serialize;

/// A change of the fail-safe machine's state.
#[derive(Serialize)]
pub struct Transition {
    tick: u32,
    from: &'static str,
    to: &'static str,
    cause: &'static str,
    /// Age of the surface, in ms.
    age: u32,
}

impl Transition {
    /// The changes of a run.
    pub fn all(ticks: &[Tick]) -> Vec<Self> {
        let changes = ticks.array_windows().filter(|[a, b]| a.state != b.state);
        changes
            .map(|[before, after]| Self {
                tick: after.tick,
                from: state_name(before.state),
                to: state_name(after.state),
                cause: cause_name(after.cause),
                age: after.age * 1_000 / TICK_RATE,
            })
            .collect()
    }
}

impl fmt::Display for Transition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, from, to, cause, age } = self;
        write!(f, "tick {tick}: {from} to {to}, {cause}, surface {age} ms old")
    }
}

fn state_name(state: u32) -> &'static str {
    match state {
        0 => "nominal",
        1 => "degraded",
        _ => "safe",
    }
}

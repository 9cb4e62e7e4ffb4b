//! Faults on the bus, and their outcome.

use std::collections::BTreeMap;

use controller::TICK_RATE;
use controller::telemetry::Tick;
use dibs_nostd::failsafe::State;
use dibs_stream::faults::Fault;
use serde::Serialize;

use super::bus::Bus;
use super::session::Outcome;

/// The plan of faults on the bus.
#[derive(Clone, Copy)]
pub struct Plan {
    /// The faults' seed.
    pub seed: u64,
    seconds: u32,
}

impl Plan {
    /// Probability of a fault in a packet.
    pub const RATE: f64 = 0.03;

    /// The kinds of faults: all that a line with packets without tags can have.
    pub const KINDS: &[Fault] = &[
        Fault::FlipOne,
        Fault::FlipTwo,
        Fault::Burst,
        Fault::Drop,
        Fault::Duplicate,
        Fault::Reorder,
        Fault::Truncate,
        Fault::Overrun,
        Fault::StaleEpoch,
        Fault::Replay,
        Fault::WrongMesh,
        Fault::OutOfRange,
        Fault::NotFinite,
        Fault::TooFar,
        Fault::Stretch,
    ];

    /// Faults in a run of this many seconds.
    pub const fn new(seed: u64, seconds: u32) -> Self {
        Self { seed, seconds }
    }

    /// Ticks during which the line is cut once: longer than the controller's limit.
    pub const fn silence(bus: Bus) -> u32 {
        bus.trust().silence.1 + TICK_RATE / 2
    }

    /// The tick after which the line is cut, as soon as a frame has been published. It is early, because an emulated
    /// serial line takes about a second for a frame, and frames after the silence must fit in the run as well.
    pub const fn silence_at(&self) -> u32 {
        self.seconds * TICK_RATE / 4
    }
}

/// The faults on the bus.
#[derive(Clone, Serialize)]
pub struct Faults {
    /// The faults' seed.
    seed: u64,
    /// Probability of a fault a packet.
    rate: f64,
    /// Count of each.
    pub injected: BTreeMap<&'static str, u64>,
}

impl Faults {
    /// The planned faults that occurred.
    pub fn new(plan: &Plan, injected: Vec<(Fault, u64)>) -> Self {
        let happened = injected.into_iter().filter(|&(_, count)| count > 0);
        let injected = happened.map(|(fault, count)| (fault.name(), count)).collect();
        Self { seed: plan.seed, rate: Plan::RATE, injected }
    }

    /// Faults of all kinds.
    pub fn total(&self) -> u64 {
        self.injected.values().sum()
    }
}

/// The effect of the silent line, by the controller's records; in ms.
#[derive(Clone, Serialize)]
pub struct Silence {
    /// Tick of the first safe output.
    pub safe_at: u32,
    /// Time from the last good packet to the first safe output.
    pub since_packet: u32,
    /// Time from the last published frame.
    pub since_frame: u32,
    /// Age of the surface then, from its frame's first packet.
    pub age: u32,
    /// Time from the first safe output to the next nominal one; the line was cut for a part of it.
    pub recovered_after: Option<u32>,
}

impl Silence {
    /// The first loss of the link.
    pub fn of(outcome: &Outcome) -> Option<Self> {
        let ticks = &outcome.ticks;
        let safe = State::Safe as u32;
        let limit = outcome.bus.trust().silence.1;
        let is_lost = |[before, after]: &[Tick; 2]| {
            before.state != safe && after.state == safe && after.silence > limit
        };
        let place = ticks.array_windows().position(is_lost)?;
        let (before, [safe, after @ ..]) = ticks.split_at(place + 1) else { return None };
        let earlier = |tick: &&Tick| tick.frames_published < safe.frames_published;
        // The record after the last one with fewer frames is the first one with this frame.
        let published = before.iter().rev().find(earlier).map_or(0, |tick| tick.tick + 1);
        let nominal = after.iter().find(|tick| tick.state == State::Nominal as u32);
        Some(Self {
            safe_at: safe.tick,
            since_packet: milliseconds(safe.silence),
            since_frame: milliseconds(safe.tick - published),
            age: milliseconds(safe.age),
            recovered_after: nominal.map(|tick| milliseconds(tick.tick - safe.tick)),
        })
    }
}

const fn milliseconds(ticks: u32) -> u32 {
    ticks * 1_000 / TICK_RATE
}

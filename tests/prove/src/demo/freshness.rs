//! How old the surface is, and the cost of the network.

use controller::TICK_RATE;
use controller::telemetry::Tick;
use dibs_nostd::failsafe::State;
use serde::Serialize;

use super::session::Outcome;

/// Clock counts in a control tick's period.
const COUNTS_A_TICK: f64 = 25e6 / TICK_RATE as f64;

/// The frame rate, the ages of the surfaces that were acted on, and the network's cost.
#[derive(Serialize)]
pub struct Freshness {
    /// Published frames a second of the controller's time, from the first to the last.
    frames_per_second: f64,
    surface_age_mean_ms: f64,
    surface_age_max_ms: u32,
    /// The network; `null` over a serial line.
    network: Option<Network>,
}

/// The cost of the network.
#[derive(Serialize)]
pub struct Network {
    /// Received Ethernet frames, those with a packet for the controller's port, and the good packets among them.
    frames: u32,
    packets: u32,
    packets_good: u32,
    /// ARP requests for the hardware address.
    questions: u32,
    /// Fractions of all instructions: for the driver and parsing frames; for checking and decoding the packets.
    driver_share: f64,
    packet_share: f64,
}

impl Freshness {
    /// Sums up a run.
    pub fn of(outcome: &Outcome) -> Self {
        let ticks = &outcome.ticks;
        let acted: Vec<&Tick> =
            ticks.iter().filter(|t| t.is_answered() && t.state != State::Safe as u32).collect();
        let sum: f64 = acted.iter().map(|tick| f64::from(tick.age)).sum();
        let all = f64::from(outcome.summary.ticks) * COUNTS_A_TICK;
        Self {
            frames_per_second: rate(ticks),
            surface_age_mean_ms: sum / acted.len().max(1) as f64 * 1e3 / f64::from(TICK_RATE),
            surface_age_max_ms: acted.iter().map(|t| t.age).max().unwrap_or(0) * 1_000 / TICK_RATE,
            network: outcome.network.map(|network| Network {
                frames: network.frames,
                packets: network.packets,
                packets_good: network.good,
                questions: network.questions,
                driver_share: f64::from(network.driver_counts) / all,
                packet_share: f64::from(network.packet_counts) / all,
            }),
        }
    }

    /// Lines for the user.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let Self { frames_per_second, surface_age_mean_ms, surface_age_max_ms, network } = self;
        let mut rows = vec![(
            "",
            format!(
                "{frames_per_second:.1} a second; surface {surface_age_mean_ms:.0} ms old, \
                 {surface_age_max_ms} at most"
            ),
        )];
        if let Some(network) = network {
            rows.push((
                "network",
                format!(
                    "{} Ethernet frames, {} packets, {} good; {:.2} % of all instructions, and {:.1} % to \
                     check and decode packets",
                    network.frames,
                    network.packets,
                    network.packets_good,
                    network.driver_share * 100.0,
                    network.packet_share * 100.0
                ),
            ));
        }
        rows
    }
}

/// Frames a second between the first publication and the last.
pub fn rate(ticks: &[Tick]) -> f64 {
    let first = ticks.iter().find(|tick| tick.frames_published > 0);
    let (Some(first), Some(last)) = (first, ticks.last()) else { return 0.0 };
    let newest = ticks.iter().find(|tick| tick.frames_published == last.frames_published);
    let time = newest.map_or(0, |newest| newest.tick - first.tick);
    let frames = last.frames_published - first.frames_published;
    f64::from(frames) * f64::from(TICK_RATE) / f64::from(time.max(1))
}

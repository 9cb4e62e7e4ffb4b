//! Limits of the trust in a surface, which depend on its bus.

use dibs_nostd::Millis;
use dibs_nostd::failsafe::{LimitError, Limits, ThresholdPair};

use crate::TICK_RATE;

/// Consecutive refused or abandoned frames after which the state is degraded, and after which it is safe.
const REJECTIONS: (u32, u32) = (10, 30);

/// Limits on forged packets, minus ten for each second. This bus has no tags and so detects no forgeries; a receiver
/// with a key has the same limits.
const FORGERIES: (u32, u32) = (0, 100);

/// Consecutive good frames that recover. Nobody acknowledges here; for a real robot leave `automatic` out.
const RECOVERY_FRAMES: u16 = 1;

/// Consecutive ticks within the limits before the state improves.
pub const DWELL: u32 = TICK_RATE / 5;

/// The limits of one bus. A pair is the time in ms after which the state is degraded, and after which it is safe.
#[derive(Clone, Copy, Debug)]
pub struct Trust {
    /// Age of the surface, counted from its frame's first packet.
    pub age: (u32, u32),
    /// Time without any good packet.
    pub silence: (u32, u32),
    /// Time without a heartbeat.
    pub heartbeat: (u32, u32),
    /// Transit time of a frame, by the status that it echoes.
    pub transit: (u32, u32),
    /// Age of a frame when it is sent: large if a source stops while its sender is alive.
    pub source_age: (u32, u32),
    /// Largest speed of the tissue, in mm a millisecond.
    pub tissue_speed: f32,
}

impl Trust {
    /// The emulated serial line: a frame takes one to three seconds, so the heart beats some fifty times slower.
    pub const SERIAL: Self = Self {
        age: (4_000, 6_000),
        silence: (1_000, 2_000),
        heartbeat: (1_000, 3_000),
        // Statuses are sent every 100 ms, and the line takes some milliseconds more for a begin packet.
        transit: (500, 1_000),
        source_age: (1_000, 2_000),
        tissue_speed: 0.001,
    };

    /// Ethernet: at 60 frames a second a surface gets some 30 ms old, and one frame may be lost before the state is
    /// degraded. The generated heart moves by at most 1.57 mm in a thirtieth of a second.
    pub const ETHERNET: Self = Self {
        age: (60, 120),
        silence: (40, 80),
        heartbeat: (1_000, 3_000),
        transit: (200, 500),
        source_age: (200, 500),
        tissue_speed: 0.05,
    };

    /// A host's socket: frames in real time, between threads without deadlines.
    pub const HOST: Self = Self { tissue_speed: Self::ETHERNET.tissue_speed, ..Self::SERIAL };

    /// The limits of the fail-safe machine.
    pub(crate) const fn limits(&self) -> Result<Limits, LimitError> {
        macro_rules! tri {
            ($result:expr) => {
                match $result {
                    Ok(value) => value,
                    Err(error) => return Err(error),
                }
            };
        }
        macro_rules! watch {
            ($pair:expr) => {
                tri!(ThresholdPair::new(Millis($pair.0), Millis($pair.1)))
            };
        }
        let limits = tri!(Limits::new(watch!(self.age), self.tissue_speed));
        let limits = tri!(limits.recovery(RECOVERY_FRAMES)).silence(watch!(self.silence));
        let limits = limits
            .heartbeat(watch!(self.heartbeat))
            .rejections(tri!(ThresholdPair::count(REJECTIONS.0, REJECTIONS.1)));
        let limits = limits.transit(watch!(self.transit));
        let limits = tri!(limits.source_age(watch!(self.source_age)));
        let forgeries = tri!(ThresholdPair::count(FORGERIES.0, FORGERIES.1));
        Ok(tri!(limits.forgeries(forgeries)).dwell(DWELL).automatic())
    }
}

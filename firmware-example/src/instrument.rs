//! The instrument's pose from a script.

use core::f32::consts::TAU;

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, ToolError};

use crate::surface::{CENTRE, REACH};

/// Length of the instrument's last link, in mm.
pub const LENGTH: f32 = 60.0;
/// Its radius, in mm.
pub const RADIUS: f32 = 2.5;

/// The instrument at a tick: a capsule that enters through a fixed port, as in keyhole surgery, while its tip moves
/// around the surface and, every seven seconds, through its middle.
///
/// The motion is the sum of a few slow sines, like a surgeon's hand, and of a physiological tremor (9 Hz, 0.1 mm). It
/// depends only on the tick, so that runs are reproducible.
///
/// # Errors
/// [`ToolError`] names a coordinate out of range; a surface of ordinary size has none.
pub fn instrument(tick: u32) -> Result<Capsule, ToolError> {
    let wave = |period: u32, phase: f32| {
        libm::sinf(TAU * ((tick % period) as f32 / period as f32 + phase))
    };
    // From 1.5 times the surface's size down to its middle.
    let distance = REACH * (0.75 + 0.75 * wave(7_000, 0.25));
    let around = Vec3::new(wave(11_000, 0.25), wave(11_000, 0.0), 0.6 * wave(5_300, 0.1));
    let tremor = Vec3::new(wave(111, 0.0), wave(113, 0.3), wave(109, 0.7)) * 0.1;
    let tip = CENTRE + around * distance + tremor;

    let port = CENTRE + Vec3::new(0.3, -0.4, 2.0) * REACH;
    let shaft = port - tip;
    let length = libm::sqrtf(shaft.length_squared());
    Capsule::new(tip, tip + shaft * (LENGTH / length), RADIUS)
}

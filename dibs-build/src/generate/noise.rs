//! Seeded gradient noise with its derivative: the same bits on every machine.

use glam::{DVec3, IVec3};

/// Perlin's gradient noise (quintic fade) at `point`, on a lattice of unit spacing: its value
/// (about -1 to 1) and gradient.
pub(super) fn noise(seed: u32, point: DVec3) -> (f64, DVec3) {
    let cell = point.floor();
    let within = point - cell;
    let corner = cell.as_ivec3();
    let fade = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    let slope = within * within * (within * (within - 2.0) + 1.0) * 30.0;
    let mut value = 0.0;
    let mut gradient = DVec3::ZERO;
    for bits in 0..8 {
        let step = IVec3::new(bits & 1, (bits >> 1) & 1, bits >> 2);
        let side = step.as_dvec3();
        let lattice = lattice_gradient(seed, corner + step);
        let ramp = lattice.dot(within - side);
        // `side` is 0 or 1: pick the falling or the rising fade in each axis.
        let weight = DVec3::ONE - fade + side * (fade * 2.0 - 1.0);
        let change = slope * (side * 2.0 - 1.0);
        let product = weight.element_product();
        value += product * ramp;
        gradient += lattice * product
            + DVec3::new(
                change.x * weight.y * weight.z,
                weight.x * change.y * weight.z,
                weight.x * weight.y * change.z,
            ) * ramp;
    }
    (value, gradient)
}

fn lattice_gradient(seed: u32, at: IVec3) -> DVec3 {
    let mut bits = seed;
    for coordinate in at.to_array() {
        // Two steps of a multiply-xorshift mixer for each coordinate.
        bits = (bits ^ coordinate as u32).wrapping_mul(0x7feb_352d);
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x846c_a68b);
        bits ^= bits >> 16;
    }
    let part = |shift: u32| f64::from((bits >> shift) & 1023) / 511.5 - 1.0;
    DVec3::new(part(0), part(10), part(20)) * 1.5
}

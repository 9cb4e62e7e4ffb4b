//! A modal surface at some weights: every vertex computed when it is asked for.

use glam::Vec3;

use super::{FRACTION_BITS, Modes};
use crate::{VertexTable, format};

/// The surface at some weights: [`Modes::surface`] makes one.
///
/// A copy of its weights and a view of flash; nothing else is stored, and nothing is computed for a
/// vertex that nobody asks for. `K` is the room for weights, at least [`Modes::count`].
///
/// The displacement is summed in integers: a 16-bit displacement times a 32-bit weight is exact in 64
/// bits, in any order, and on a Cortex-M7 one instruction. What is rounded is the sum, once, to 32
/// bits, its conversion, and its sum with the rest position: the same bits on host and target.
///
/// RAM: `4 K` bytes and a copy of [`Modes`].
#[derive(Clone, Copy, Debug)]
pub struct ModalSurface<'a, const K: usize> {
    modes: Modes<'a>,
    /// Weight times gain, a mode.
    gains: [i32; K],
}

impl<'a, const K: usize> ModalSurface<'a, K> {
    /// For weights that were checked; those beyond `K` are left out.
    pub(super) fn new(modes: &Modes<'a>, weights: impl Iterator<Item = f32>) -> Self {
        let mut gains = [0; K];
        for ((gain, weight), mode) in gains.iter_mut().zip(weights).zip(modes.modes()) {
            *gain = (weight * mode.gain) as i32;
        }
        Self { modes: *modes, gains }
    }

    /// The modes that move this surface.
    #[must_use]
    pub const fn modes(&self) -> &Modes<'a> {
        &self.modes
    }
}

impl<const K: usize> VertexTable for ModalSurface<'_, K> {
    fn len(&self) -> usize {
        self.modes.vertices as usize
    }

    /// Cost: 6 bytes of flash and three multiply-accumulates a mode.
    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let rest = format::rest_position(self.modes.rest, vertex)?;
        let (mut x, mut y, mut z) = (0_i64, 0_i64, 0_i64);
        for (&gain, &[x0, x1, y0, y1, z0, z1]) in self.gains.iter().zip(self.modes.row(vertex)?) {
            let gain = i64::from(gain);
            x += gain * i64::from(i16::from_le_bytes([x0, x1]));
            y += gain * i64::from(i16::from_le_bytes([y0, y1]));
            z += gain * i64::from(i16::from_le_bytes([z0, z1]));
        }
        // The layout's check bounds the sums: below 2^31 after the shift.
        let [x, y, z] = [x, y, z].map(|sum| (sum >> FRACTION_BITS) as i32 as f32);
        Some(rest + Vec3::new(x, y, z) * self.modes.header.unit)
    }
}

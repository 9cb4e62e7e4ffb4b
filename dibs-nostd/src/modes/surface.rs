//! A modal surface at some weights: each vertex is computed when it is read.

use glam::Vec3;

use super::{FRACTION_BITS, Modes};
use crate::surface::VertexTable;
use crate::tree::format;

/// The surface at some weights: [`Modes::surface`] makes one.
///
/// It stores a copy of its weights and a view of flash. `K` is the capacity for weights, at least [`Modes::count`].
///
/// The displacement is summed in integers: a 32-bit weight times a 16-bit displacement, of which the upper 32 of 48
/// bits are added. That takes one instruction on a Cortex-M7, where floats take a conversion, a product and a sum, and
/// it gives the same bits in any order. Only the sum's conversion and its addition to the rest position round.
///
/// RAM: `4 K` bytes and a copy of [`Modes`].
#[derive(Clone, Copy, Debug)]
pub struct ModalSurface<'a, const K: usize> {
    pub(super) modes: Modes<'a>,
    /// Weight times gain of each mode.
    pub(super) gains: [i32; K],
}

impl<'a, const K: usize> ModalSurface<'a, K> {
    /// For checked weights; those beyond `K` are left out.
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
        let (mut x, mut y, mut z) = (0_i32, 0_i32, 0_i32);
        for (&gain, mode) in self.gains.iter().zip(self.modes.row(vertex)?) {
            // One load for two axes.
            let xy = i32::from_le_bytes(*mode.first_chunk()?);
            // The layout's check bounds the sums, so they do not wrap.
            x = x.wrapping_add(scaled(gain, xy as i16));
            y = y.wrapping_add(scaled(gain, (xy >> 16) as i16));
            z = z.wrapping_add(scaled(gain, i16::from_le_bytes(*mode.last_chunk()?)));
        }
        Some(rest + Vec3::new(x as f32, y as f32, z as f32) * self.modes.header.unit)
    }

    /// The error for the motion to which the modes were fitted.
    fn position_error(&self) -> f32 {
        self.modes.position_error()
    }
}

/// One mode's displacement on one axis, in units. With the addition it is `smlawb` or `smlawt` on ARM.
#[inline(always)]
const fn scaled(gain: i32, displacement: i16) -> i32 {
    ((gain as i64 * displacement as i64) >> FRACTION_BITS) as i32
}

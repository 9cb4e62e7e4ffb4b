//! A modal surface at some weights: every vertex computed when it is asked for.

use glam::Vec3;

use super::{FRACTION_BITS, Modes};
use crate::surface::VertexTable;
use crate::tree::format;

/// Above the square root of 3, by more than sums and products of a few numbers are rounded.
const DIAGONAL: f32 = 1.7321;

/// The surface at some weights: [`Modes::surface`] makes one.
///
/// A copy of its weights and a view of flash; nothing else is stored, and nothing is computed for a
/// vertex that nobody asks for. `K` is the room for weights, at least [`Modes::count`].
///
/// The displacement is summed in integers: a 32-bit weight times a 16-bit displacement, the upper 32 of
/// 48 bits, added up. That is one instruction on a Cortex-M7, where floats take a conversion, a
/// product and a sum, and the same bits in any order. Its conversion and its sum with the rest position are rounded as all floats are.
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

    /// No vertex is farther than this from where it is on `before`, a surface of the same modes (mm), but for the
    /// rounding of the two positions.
    ///
    /// A mode moves a vertex by at most 2^15 of its steps an axis, and rounds down: `gain * 2^15 / 2^16` units, and one.
    pub(super) fn farthest_from(&self, before: &Self) -> f32 {
        let halves = |(now, before): (&i32, &i32)| u64::from(now.abs_diff(*before)) + 2;
        let sum: u64 = self.gains.iter().zip(&before.gains).map(halves).sum();
        sum as f32 * (0.5 * DIAGONAL) * self.modes.header.unit
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
        for (&gain, &[x0, x1, y0, y1, z0, z1]) in self.gains.iter().zip(self.modes.row(vertex)?) {
            // The layout's check bounds the sums: nothing wraps.
            x = x.wrapping_add(scaled(gain, [x0, x1]));
            y = y.wrapping_add(scaled(gain, [y0, y1]));
            z = z.wrapping_add(scaled(gain, [z0, z1]));
        }
        Some(rest + Vec3::new(x as f32, y as f32, z as f32) * self.modes.header.unit)
    }

    /// Against the motion that the modes were fitted to.
    fn position_error(&self) -> f32 {
        self.modes.position_error()
    }
}

/// One axis of one mode's share, in units: `smlawb` or `smlawt` on ARM, with the sum that it goes to.
#[inline(always)]
const fn scaled(gain: i32, displacement: [u8; 2]) -> i32 {
    ((gain as i64 * i16::from_le_bytes(displacement) as i64) >> FRACTION_BITS) as i32
}

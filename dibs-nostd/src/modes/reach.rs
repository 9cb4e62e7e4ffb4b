//! The farthest that any vertex moves when the weights change.

use super::{FRACTION_BITS, ModalSurface, Modes};
use crate::math::sqrt::sqrt;

/// The square root of 3, rounded up by more than the rounding of a few operations.
const DIAGONAL: f32 = 1.7321;

/// Allowance for the f32 rounding of a sum over all modes.
const ROUNDING: f32 = 1.0 + 1.0 / 65_536.0;

/// The length of each mode's largest displacement, in units of a sum for a gain of 1.
///
/// Displacements are linear in the weights, so no vertex moves farther than the sum, over the modes, of these lengths
/// times the gains' changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach<const K: usize>([f32; K]);

impl<const K: usize> Reach<K> {
    /// Cost: one pass over the displacements of all vertices.
    pub fn of(modes: &Modes<'_>) -> Self {
        let mut squares = [0_u32; K];
        for row in (0..modes.vertices).filter_map(|vertex| modes.row(vertex)) {
            for (largest, &[x0, x1, y0, y1, z0, z1]) in squares.iter_mut().zip(row) {
                let axes = [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes);
                // Three squares of at most 2^30.
                let square = axes.iter().fold(0_u32, |sum, axis| {
                    let axis = u32::from(axis.unsigned_abs());
                    sum.wrapping_add(axis * axis)
                });
                *largest = if square > *largest { square } else { *largest };
            }
        }
        Self(squares.map(|square| sqrt(square as f32) / (1_u32 << FRACTION_BITS) as f32))
    }

    /// Upper bound (mm) on the distance of a vertex on one surface from its position on the other, but for the rounding
    /// of the two positions.
    pub fn between(&self, before: &ModalSurface<'_, K>, after: &ModalSurface<'_, K>) -> f32 {
        let gains = before.gains.iter().zip(&after.gains);
        let sum: f32 = gains
            .zip(&self.0)
            // Each axis of both displacements is rounded down.
            .map(|((before, after), reach)| after.abs_diff(*before) as f32 * reach + DIAGONAL)
            .sum();
        sum * ROUNDING * after.modes.header.unit
    }
}

#[cfg(test)]
mod tests {
    use dibs_build::modes::ModalFit;
    use dibs_build::{Builder, generate};

    use super::*;
    use crate::{Tree, VertexTable};

    /// No vertex moves farther, and when one mode moves the bound is that of a vertex.
    #[test]
    fn no_vertex_moves_farther() {
        let generate::MovingMesh { mesh, motion } = generate::heart(320).unwrap();
        let fit = ModalFit::new(&mesh, &motion).unwrap();
        let built = Builder::new().stretch(1.5).build(&mesh).unwrap().with_modes(&fit, 2).unwrap();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let modes = Modes::of(&tree).unwrap();
        let reach = Reach::<2>::of(&modes);
        let [one, other] = [0, 1].map(|mode| modes.range(mode).unwrap());
        let at = |range: [f32; 2], share: f32| range[0] + (range[1] - range[0]) * share;
        let mut rng = fastrand::Rng::with_seed(4);
        let mut largest = 0.0_f32;
        for trial in 0..400 {
            let [before, after] = [(); 2].map(|()| {
                let second = if trial % 2 == 0 { 0.5 } else { rng.f32() };
                modes.surface::<2>(&[at(one, rng.f32()), at(other, second)]).unwrap()
            });
            let moved = (0..modes.vertex_count())
                .map(|row| before.position(row).unwrap().distance(after.position(row).unwrap()))
                .fold(0.0, f32::max);
            let bound = reach.between(&before, &after);
            assert!(moved <= bound + 2e-5, "{moved} {bound}");
            if trial % 2 == 0 {
                assert!(bound <= moved * 1.001 + 5e-5, "{moved} {bound}");
            }
            largest = largest.max(moved);
        }
        assert!(largest > 1.0, "{largest}");
    }
}

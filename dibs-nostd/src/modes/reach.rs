//! The farthest that any vertex moves when the weights change.

use glam::{Mat3, Vec3};

use super::{FRACTION_BITS, ModalSurface, Modes, VERTEX_MODE_BYTES};
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;

/// The square root of 3, rounded up by more than the rounding of a few operations.
const DIAGONAL: f32 = 1.7321;

/// Allowance for the f32 rounding of sums over all modes.
const ROUNDING: f32 = 1.0 + 1.0 / 65_536.0;

/// The sizes of the modes' displacements.
///
/// A vertex moves by the sum, over the modes, of its displacement times the change of the gain. Two bounds hold: the
/// sum of the modes' largest displacements, each times the change of its gain; and the root of the sum of the squares
/// of these products, times the largest norm of a vertex's displacements, each mode's divided by its largest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach<const K: usize> {
    /// The length of each mode's largest displacement, in units of a sum at a gain of 1.
    largest: [f32; K],
    /// The largest norm of a vertex's matrix of 3 x `K` such quotients.
    norm: f32,
}

impl<const K: usize> Reach<K> {
    /// Cost: two passes over the displacements of all vertices.
    pub fn of(modes: &Modes<'_>) -> Self {
        let rows = || (0..modes.vertices).filter_map(|vertex| modes.row(vertex));
        let mut largest = [0.0_f32; K];
        for row in rows() {
            for (largest, displacement) in largest.iter_mut().zip(row) {
                let square = vector(displacement).length_squared();
                *largest = larger(*largest, square);
            }
        }
        let largest = largest.map(sqrt);
        let mut norm = 0.0_f32;
        for row in rows() {
            let quotients = row.iter().zip(&largest).filter(|(_, largest)| **largest > 0.0);
            let quotients =
                quotients.map(|(displacement, largest)| vector(displacement) / *largest);
            let found = fourth_power_of_norm(quotients);
            norm = larger(norm, found);
        }
        let scale = (1_u32 << FRACTION_BITS) as f32;
        Self { largest: largest.map(|length| length / scale), norm: sqrt(sqrt(norm)) }
    }

    /// Upper bound (mm) on the distance of a vertex on one surface from its position on the other, without the rounding
    /// of the two positions.
    pub fn between(&self, before: &ModalSurface<'_, K>, after: &ModalSurface<'_, K>) -> f32 {
        let (mut sum, mut squares) = (0.0, 0.0);
        let gains = before.gains.iter().zip(&after.gains);
        for ((before, after), largest) in gains.zip(&self.largest) {
            let moved = after.abs_diff(*before) as f32 * largest;
            sum += moved;
            squares += moved * moved;
        }
        let together = sqrt(squares) * self.norm;
        let moved = smaller(sum, together);
        // Each axis of both displacements is rounded down, mode by mode.
        (moved * ROUNDING + DIAGONAL * K as f32) * after.modes.header.unit
    }
}

fn vector(&[x0, x1, y0, y1, z0, z1]: &[u8; VERTEX_MODE_BYTES]) -> Vec3 {
    Vec3::from([[x0, x1], [y0, y1], [z0, z1]].map(|axis| f32::from(i16::from_le_bytes(axis))))
}

/// An upper bound on the norm of the matrix with these columns, to the fourth power: the norm's square is an eigenvalue
/// of the matrix times its transpose, whose square has a Frobenius norm not below that eigenvalue's square.
fn fourth_power_of_norm(columns: impl Iterator<Item = Vec3>) -> f32 {
    let (mut squares, mut products) = (Vec3::ZERO, Vec3::ZERO);
    for column in columns {
        squares += column * column;
        products += column * Vec3::new(column.y, column.z, column.x);
    }
    let Vec3 { x: xy, y: yz, z: zx } = products;
    let square = Mat3::from_cols(
        Vec3::new(squares.x, xy, zx),
        Vec3::new(xy, squares.y, yz),
        Vec3::new(zx, yz, squares.z),
    );
    let square = square * square;
    let columns = [square.x_axis, square.y_axis, square.z_axis];
    sqrt(columns.iter().map(|column| column.length_squared()).sum())
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::modes::tests::{MODES, surface};
    use crate::{Tree, VertexTable};

    /// No vertex moves farther than the bound for any weights, also if they are chosen so that one vertex moves as far
    /// as it can.
    #[test]
    fn no_vertex_moves_farther() {
        let built = surface();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let modes = Modes::of(&tree).unwrap();
        let reach = Reach::<MODES>::of(&modes);
        let ranges: [[f32; 2]; MODES] = core::array::from_fn(|mode| modes.range(mode).unwrap());
        let mut rng = Rng::with_seed(4);
        let mut tightest = [f32::INFINITY; 3];
        for trial in 0..3_000 {
            let kind = trial % 3;
            let vertex = rng.u32(..modes.vertex_count());
            let toward = Vec3::from([(); 3].map(|()| rng.f32() - 0.5)).normalize();
            let one = rng.usize(..MODES);
            let change: [f32; MODES] = core::array::from_fn(|mode| {
                let step = modes.step(mode).unwrap();
                let [x, y, z] = modes.displacement(mode, vertex).unwrap().map(f32::from);
                let along = Vec3::new(x, y, z).dot(toward);
                match kind {
                    0 => rng.f32() - 0.5,
                    1 => f32::from(u8::from(mode == one)),
                    _ => along / (step * reach.largest[mode] * reach.largest[mode]),
                }
            });
            // As far as the ranges allow.
            let scales = change.iter().zip(&ranges).map(|(change, [low, high])| {
                let room = 0.5 * (high - low);
                if *change == 0.0 { f32::INFINITY } else { room / change.abs() }
            });
            let scale = scales.fold(f32::INFINITY, f32::min) * rng.f32();
            let middle = ranges.map(|[low, high]| 0.5 * (low + high));
            let at = |sign: f32| {
                let weights: [f32; MODES] =
                    core::array::from_fn(|mode| middle[mode] + sign * 0.999 * scale * change[mode]);
                modes.surface::<MODES>(&weights).unwrap()
            };
            let (before, after) = (at(-1.0), at(1.0));
            let moved = (0..modes.vertex_count())
                .map(|row| before.position(row).unwrap().distance(after.position(row).unwrap()))
                .fold(0.0, f32::max);
            let bound = reach.between(&before, &after);
            assert!(moved <= bound + 2e-5, "{trial}: {moved} {bound}");
            if moved > 1.0 {
                tightest[kind] = tightest[kind].min(bound / moved);
            }
        }
        // One mode alone moves its farthest vertex by the whole bound.
        assert!(tightest[0] < 1.3 && tightest[1] < 1.001 && tightest[2] < 1.2, "{tightest:?}");
    }
}

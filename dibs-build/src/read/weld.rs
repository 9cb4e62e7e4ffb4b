//! Merges vertices that coincide.

use glam::Vec3;
use std::collections::HashMap;

/// For every vertex the first one that it coincides with: itself, or an earlier kept vertex at most `tolerance` away.
/// So no chain of close vertices collapses into one, and the result depends only on the order of the vertices. Cost:
/// linear, for tolerances below the typical distance of vertices.
pub(crate) fn first_coincident(positions: &[Vec3], tolerance: f32) -> Vec<u32> {
    if tolerance > 0.0 { within(positions, tolerance) } else { equal(positions) }
}

fn equal(positions: &[Vec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    (0..)
        .zip(positions)
        .map(|(vertex, position)| {
            // Adding 0 turns -0.0 into 0.0, and changes no other number.
            let key = position.to_array().map(|c| (c + 0.0).to_bits());
            *first.entry(key).or_insert(vertex)
        })
        .collect()
}

fn within(positions: &[Vec3], tolerance: f32) -> Vec<u32> {
    let mut kept_in_cell: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let tolerance = f64::from(tolerance);
    let mut first = Vec::with_capacity(positions.len());
    for (vertex, position) in (0..).zip(positions) {
        let position = position.as_dvec3();
        let cell = position.to_array().map(|c| (c / tolerance).floor() as i64);
        let near = neighbours(cell)
            .filter_map(|neighbour| kept_in_cell.get(&neighbour))
            .flatten()
            .copied()
            .filter(|&kept| {
                let other: Vec3 = positions[kept as usize];
                other.as_dvec3().distance_squared(position) <= tolerance * tolerance
            })
            .min();
        first.push(near.unwrap_or(vertex));
        if near.is_none() {
            kept_in_cell.entry(cell).or_default().push(vertex);
        }
    }
    first
}

fn neighbours([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| {
        [x.saturating_add(i % 3 - 1), y.saturating_add(i / 3 % 3 - 1), z.saturating_add(i / 9 - 1)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_weld_and_negative_zero_is_zero() {
        let positions = [
            Vec3::new(0.0, 1.0, 2.0),
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(-0.0, 1.0, 2.0),
            Vec3::new(1.0, 0.0, f32::MIN_POSITIVE),
        ];
        assert_eq!(first_coincident(&positions, 0.0), [0, 1, 0, 3]);
    }

    #[test]
    fn tolerance_reaches_across_cells_and_does_not_chain() {
        let at = |x| Vec3::new(x, -5.0, 0.0);
        let positions = [at(0.99), at(1.01), at(1.08), at(1.17), at(-3.0)];
        // The third vertex is near the second, which was merged, and within 0.1 of the first.
        assert_eq!(first_coincident(&positions, 0.1), [0, 0, 0, 3, 4]);
    }

    #[test]
    fn tolerance_agrees_with_comparing_all_pairs() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as f32 / 65536.0 - 0.5
        };
        let positions: Vec<Vec3> =
            (0..500).map(|_| Vec3::new(random(), random(), random())).collect();
        for tolerance in [0.01_f32, 0.1, 0.3, 5.0] {
            let mut expected: Vec<u32> = Vec::new();
            for (i, p) in positions.iter().enumerate() {
                let near = (0..i).find(|&j| {
                    let d = positions[j].as_dvec3().distance(p.as_dvec3());
                    expected[j] as usize == j && d <= f64::from(tolerance)
                });
                expected.push(near.unwrap_or(i) as u32);
            }
            assert_eq!(first_coincident(&positions, tolerance), expected, "{tolerance}");
        }
    }
}
